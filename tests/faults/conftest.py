"""Runs of the workflow that nothing disturbed, for the tests that compare with them."""

import pytest
from one_scene import PART, undisturbed_run
from workflow_copy import Workflow


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Workflow:
    return undisturbed_run(tmp_path_factory.mktemp("faults"))


@pytest.fixture(scope="session")
def undisturbed_part(tmp_path_factory: pytest.TempPathFactory) -> Workflow:
    """Of a part of what is made of a scene alone."""
    return undisturbed_run(tmp_path_factory.mktemp("faults-part"), PART)
