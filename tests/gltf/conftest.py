"""One renderer for all tests of glTF files, none of which may log an error."""

from collections.abc import Iterator

import pytest
from gltf_stage import Eye


@pytest.fixture(scope="session")
def eye() -> Eye:
    return Eye()


@pytest.fixture(autouse=True)
def no_errors_in_the_log(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    yield
    assert not [record.getMessage() for record in caplog.get_records("call") if record.levelname in ("ERROR", "CRITICAL")]
