"""A run of the workflow that nothing disturbed, for the tests that compare with it."""

import pytest
from one_scene import undisturbed_run
from workflow_copy import Workflow


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Workflow:
    return undisturbed_run(tmp_path_factory.mktemp("faults"))
