"""Parameters of the decision between the two surfaces of a depth step."""

from pydantic import Field

from sepi.stage import OcclusionMarginParameters


class BoundaryParameters(OcclusionMarginParameters):
    """What is a depth step, and what decides which side of it a pixel is on."""

    use_shares: bool = Field(True, description="whether the decision uses the shares of both surfaces in all views")
    use_mixture: bool = Field(True, description="whether the decision uses mixed colours of the reference view")
    use_lines: bool = Field(
        True, description="whether straight edges through its neighbours decide about a pixel; false: the pixel alone"
    )
    boundary_step: float = Field(
        0.3, gt=0, description="depth step beside which pixels may be of either surface, pixels per view step"
    )
    clean_radius: int = Field(
        7, ge=1, le=20, description="distance within which unmixed colours of both surfaces are searched, in pixels"
    )
    share_evidence: float = Field(
        0.018,
        ge=0,
        lt=1,
        description="cost of a change to the other surface, for a whole pixel, relative to the views' mean costs, 0..1",
    )
    share_radius: int = Field(2, ge=1, le=10, description="distance from the step within which shares decide, pixels")
    share_scale: float = Field(
        0.2,
        gt=0,
        le=2,
        description="residual at which a view counts half, as a share of the difference of both surfaces' colours",
    )
    share_views: int = Field(81, ge=2, description="least number of views for the shares")
    alpha_threshold: float = Field(
        0.39, gt=0, le=1, description="share of the nearer surface below which the colours show the farther one"
    )
    alpha_contrast: float = Field(
        9.0,
        ge=0,
        description="squared colour difference of the two sides at which the mixture counts half, in units of their "
        "variance",
    )
    speck_area: int = Field(4, ge=0, le=100, description="largest speck, which joins its surroundings, in pixels")
    hole_area: int = Field(8, ge=0, le=100, description="the same where all its surroundings are nearer")
