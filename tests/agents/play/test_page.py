"""The page as its server sends it, without a browser."""

import pytest

viser = pytest.importorskip("viser")

from agents.play.choices import Choices  # noqa: E402
from agents.play.page import Page  # noqa: E402
from agents.play.recorder import Recorder  # noqa: E402
from agents.play.session import Session  # noqa: E402

TASKS = ["CCR/SpatialPush-v1", "CCR/BracedPush-v1", "CCR/LoadCell-v1", "CCR/InsertAndPush-v1", "CCR/PushObstacle-v1"]


@pytest.fixture
def played(tmp_path, monkeypatch):
    """A session, its page, and the messages sent so far as a list of names of their types and what they are of."""
    server = viser.ViserServer("127.0.0.1", 8473, verbose=False)
    sent, interface = [], server.gui._websock_interface
    queue = interface.queue_message
    monkeypatch.setattr(interface, "queue_message", lambda message: (sent.append(message), queue(message)))
    session = Session(Choices())
    yield session, Page(server, session, Recorder(tmp_path)), sent
    session.close()
    server.stop()


def shown(sent):
    """Label or title of each component that is visible, in the order of the page, with what it was last set to."""
    components = {}
    for message in sent:
        if hasattr(message, "container_uuid"):
            components[message.uuid] = {"value": getattr(message, "value", None), **vars(message.props)}
        elif type(message).__name__ == "GuiUpdateMessage":
            components.setdefault(message.uuid, {}).update(message.updates)
    visible = sorted((c for c in components.values() if c.get("visible")), key=lambda c: c["order"])
    return {c.get("label", c.get("title")): c for c in visible if "label" in c or "title" in c}


def test_nothing_is_removed_that_may_have_been_updated(played):
    session, page, sent = played
    for env_id in TASKS:
        session.choose("env_id", env_id)
        for _ in range(10):
            page.tick()
    assert session.choices.env_id == TASKS[-1]
    assert "GuiUpdateMessage" in {type(message).__name__ for message in sent}
    assert "GuiRemoveMessage" not in {type(message).__name__ for message in sent}


def test_controls_and_charts_follow_the_environment(played):
    session, page, sent = played
    first = [name for name in shown(sent) if name]
    for env_id in TASKS:
        session.choose("env_id", env_id)
        page.tick()
        spec, components = session.env.action_spec, shown(sent)
        sizes = [i for i, obstacle in enumerate(session.equilibrium.scene) if obstacle.size_fields]
        cables = [f"Cable {i + 1} [mm]" if i < spec.commands else "Length [mm]" for i in range(spec.size)]
        sliders = ["Set-point [mN]", *cables, *(f"Size of obstacle {i + 1}" for i in sizes)]
        names = list(components)
        start = names.index("Set-point [mN]")
        assert names[start - 1 : start + len(sliders) + 1] == ["Driver", *sliders, "Scene"]
        assert len(components["Cable tension [N]"]["series"]) == 1 + len(session.equilibrium.tensions)
        for index, name in enumerate(cables):
            slider, low, high = components[name], spec.low_mm[index], spec.high_mm[index]
            assert (slider["min"], slider["max"]) == pytest.approx((low, high), abs=slider["step"])
            assert slider["min"] <= slider["value"] <= slider["max"]
    assert [name for name in shown(sent) if name] == first
