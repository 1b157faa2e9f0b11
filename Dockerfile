# sepi and its workflow in an image, for machines without a Python of one's own, and to run later what ran today: the versions
# are those of requirements.lock.
#
#   docker build --tag sepi .
#   docker run --rm --user "$(id -u):$(id -g)" --volume "$PWD:/data" sepi depth pictures
#   docker run --rm --user "$(id -u):$(id -g)" --volume "$PWD:/data" --entrypoint snakemake sepi --snakefile /opt/sepi/Snakefile
#
# Any user may run it; only what is below /data is kept.

FROM python:3.11-slim AS wheel
COPY . /source
RUN python -m pip wheel --no-cache-dir --no-deps --wheel-dir /wheel /source

FROM python:3.11-slim
# the lock also has what only work on sepi needs: as constraints it gives versions, and no package more
RUN --mount=type=bind,from=wheel,source=/wheel,target=/wheel \
    --mount=type=bind,source=requirements.lock,target=/requirements.lock \
    python -m pip install --no-cache-dir --constraint /requirements.lock /wheel/*.whl
COPY Snakefile config.yaml /opt/sepi/
COPY rules /opt/sepi/rules
COPY profiles /opt/sepi/profiles

# Home in a folder that any user may write to: `--user` can be one that the image does not know. Such a user has no name either,
# which Snakemake asks for.
ENV HOME=/home/sepi USER=sepi
RUN useradd --uid 1000 --create-home sepi \
    && chmod -R a+rwX /home/sepi
# by number: systems that refuse root cannot know the name
USER 1000
WORKDIR /data
ENTRYPOINT ["sepi"]
