"""GIFs are written from the environment's own pictures, and none is overwritten."""

import imageio.v2 as imageio

from agents.play.choices import Choices
from agents.play.recorder import Recorder
from agents.play.session import Session


def test_a_recording_is_a_gif_of_pictures(tmp_path):
    session, recorder = Session(Choices()), Recorder(tmp_path)
    paths = []
    for _ in range(2):
        recorder.start()
        for _ in range(3):
            session.tick()
            recorder.add(session.picture())
        paths.append(recorder.stop())
    assert [path.name for path in paths] == ["play-000.gif", "play-001.gif"]
    assert len(imageio.mimread(paths[0])) == 3
    assert imageio.imread(paths[0]).shape[:2] == session.picture().shape[:2]
    assert recorder.stop() is None


def test_a_recording_without_pictures_leaves_no_file(tmp_path):
    recorder = Recorder(tmp_path)
    recorder.start()
    assert recorder.stop() is None
    assert not list(tmp_path.iterdir())
