"""A drape in the caller's recording."""

from __future__ import annotations

from pathlib import Path

import partwise as pw
import pytest

rr = pytest.importorskip("rerun")

PATHS = Path(__file__).parents[2] / "src" / "record" / "paths.rs"


def test_a_drape_is_logged_under_the_entity_paths_of_a_recording(tmp_path: Path) -> None:
    drape = pw.drape(garment="flared-skirt@400")
    file = tmp_path / "drape.rrd"
    with rr.RecordingStream("partwise_test") as recording:
        recording.save(file)
        recording.set_time("table", sequence=3)
        pw.log(drape, recording=recording)
        pw.log(drape, prefix="/left", recording=recording)
        recording.flush()
    data = file.read_bytes()
    documented = PATHS.read_text().replace("<name>", "strain")
    logged = ["/body", "/garment", "/distance/garment", "/parts/garment", "/force/garment", "/drape/garment"]
    for path in [*logged, "/fit/strain/garment"]:
        assert f"`{path}`" in documented, path
        assert data.count(path.encode()) >= 1, path
        assert f"/left{path}".encode() in data, path
