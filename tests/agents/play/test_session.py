"""A session without a browser: every input at any time, none of which may raise."""

import re

import numpy as np
import pytest

from agents.play.choices import MODELS, SENSINGS, Choices, drivers
from agents.play.dragging import FARTHEST
from agents.play.session import Session
from agents.play.shapes import contacts_of, to_page
from ccr_gym import ENV_IDS
from solver import PRESETS, Status


def run(session, ticks):
    for _ in range(ticks):
        frame = session.tick()
    assert session.faults == 0
    return frame


def drag_into_robot(session):
    """Drags the first obstacle to the middle of the robot, in ticks until it stands."""
    length = session.env.settings.scales.length_mm
    nodes = session.equilibrium.nodes
    middle = nodes[len(nodes) // 2, : session.equilibrium.forces.shape[1]]
    session.drag(0, tuple((middle - 0.02 * length).tolist()))
    return run(session, 60)


def test_pulls_follow_the_slider():
    session = Session(Choices())
    session.pull(0, 3.0)
    frame = run(session, 40)
    assert frame.numbers.actuated_mm == pytest.approx([3.0], abs=1e-6)
    session.nudge(0, -4)
    frame = run(session, 20)
    assert frame.numbers.actuated_mm == pytest.approx([3.0 - 4 * 0.5], abs=1e-6)


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1"])
def test_an_obstacle_dragged_into_the_robot_pushes_it(env_id):
    session = Session(Choices(env_id=env_id))
    before = run(session, 2)
    assert before.numbers.true == 0
    assert not len(before.contacts.points)
    after = drag_into_robot(session)
    assert after.numbers.true > 0
    assert len(after.contacts.points)
    assert after.contacts.touched == {0}
    assert np.abs(after.shape.nodes - before.shape.nodes).max() > 0.01
    assert max(session.equilibrium.residuals()) < 1e-6


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/BracedPush-v1", "CCR/SpatialPush-v1"])
def test_arrows_point_from_the_contact_into_the_regulated_obstacle(env_id):
    """As in the environments' own pictures: what the robot exerts, the opposite of the force on it."""
    session = Session(Choices(env_id=env_id, driver="Oracle"))
    contacts, equilibrium = run(session, 60).contacts, session.equilibrium
    target, scales = session.env.task.target or 0, session.env.settings.scales
    touching = to_page(equilibrium.points[equilibrium.contact[target]], scales.length_mm)
    force, shaft = to_page(equilibrium.forces[target], 1.0), np.diff(contacts.arrow_true, axis=0)[0]
    size = np.linalg.norm(force)
    assert size > 0
    np.testing.assert_allclose(shaft / np.linalg.norm(shaft), -force / size, atol=1e-9)
    tail = contacts.arrow_true[0]
    assert np.linalg.norm(touching - tail, axis=1).min() < 0.06
    assert np.diff(contacts.arrow_est, axis=0)[0] @ force < 0


def test_an_estimate_without_a_contact_has_no_arrow():
    session = Session(Choices())
    assert not session.equilibrium.contact.any()
    contacts = contacts_of(session.equilibrium, np.zeros(2), np.ones(2), None, session.env.settings.scales)
    assert not np.diff(contacts.arrow_est, axis=0).any()


def test_a_blocked_obstacle_stays_and_says_so():
    session = Session(Choices(env_id="CCR/LoadCell-v1"))
    session.pull(0, 8.0)
    run(session, 60)
    stops = session.dragging.stops
    point = session.equilibrium.scene.obstacles[0].extent.center
    session.drag(0, (point[0] - 150.0, point[1]))
    messages = [session.tick().numbers.message for _ in range(80)]
    assert session.dragging.stops > stops
    assert any("no further" in message for message in messages)
    assert session.faults == 0
    assert not session.dragging.active


def test_sizes_follow_the_slider():
    session = Session(Choices())
    radius = session.equilibrium.scene.obstacles[0].radius
    session.resize(0, 1.3)
    run(session, 30)
    assert session.equilibrium.scene.obstacles[0].radius == pytest.approx(1.3 * radius, rel=1e-12)


def test_the_set_point_follows_the_slider():
    session = Session(Choices(driver="PI"))
    run(session, 80)
    session.desire(0.2)
    frame = run(session, 80)
    assert frame.numbers.desired == pytest.approx(0.2)
    assert frame.numbers.true == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize("driver", ["MPC", "Distilled"])
def test_policies_drive_while_an_obstacle_is_dragged(driver):
    session = Session(Choices().changed("driver", driver))
    frame = run(session, 64)
    assert frame.numbers.true > 0
    x, y = session.equilibrium.scene.obstacles[0].extent.center
    session.drag(0, (x - 8.0, y + 3.0))
    frame = run(session, 200)
    assert frame.numbers.true == pytest.approx(frame.numbers.desired, rel=0.5)


def test_wrong_inputs_are_refused_with_a_message():
    session = Session(Choices())
    for act in (
        lambda: session.choose("robot", "octopus"),
        lambda: session.choose("driver", "SAC"),
        lambda: session.drag(7, (0.0, 0.0)),
        lambda: session.drag(0, (float("nan"), 0.0)),
        lambda: session.resize(0, 50.0),
        lambda: session.pull(3, 1.0),
    ):
        session.say("")
        act()
        assert "must" in session.tick().numbers.message or "range" in session.tick().numbers.message
    assert session.faults == 0


def test_a_learned_policy_leaves_a_robot_that_it_does_not_know():
    session = Session(Choices().changed("driver", "PPO"))
    session.choose("robot", "snake_arm")
    assert "cannot drive" in session.tick().numbers.message
    assert session.choices.driver == "Hand"


def test_messages_name_obstacles_in_words():
    session = Session(Choices())
    drag_into_robot(session)
    x, y = session.equilibrium.scene.obstacles[0].center
    session.straighten()
    message = session.tick().numbers.message
    assert re.fullmatch(
        rf"The circle of radius \d+\.\d mm at \({x:.1f}, {y:.1f}\) mm overlaps the unstressed robot by .* at node \d+",
        message,
    )


def test_straighten_keeps_scene_and_set_point():
    session = Session(Choices())
    scene, desired = session.equilibrium.scene, session.desired
    session.pull(0, 4.0)
    run(session, 30)
    session.straighten()
    assert session.equilibrium.scene == scene
    assert session.desired == desired
    assert not session.equilibrium.cables_mm.any()


def random_input(session, generator):
    """Gives a session one random input."""
    choices = session.choices
    options = {"env_id": tuple(ENV_IDS), "robot": tuple(PRESETS), "model": MODELS, "sensing": SENSINGS}
    options["driver"] = tuple(name for name in drivers(choices.env_id) if name not in ("Newton", "Oracle"))
    space, length = session.equilibrium.forces.shape[1], session.env.settings.scales.length_mm
    obstacle = int(generator.integers(len(session.equilibrium.scene)))
    spec = session.env.action_spec
    match generator.integers(9):
        case 0:
            name = str(generator.choice(list(options)))
            session.choose(name, str(generator.choice(options[name])))
        case 1 | 2 | 3:
            session.drag(obstacle, tuple((FARTHEST / 4 * length * generator.normal(size=space)).tolist()))
        case 4:
            session.resize(obstacle, float(generator.uniform(0.3, 3)))
        case 5 | 6:
            index = int(generator.integers(spec.size))
            session.pull(index, float(generator.uniform(spec.low_mm[index], spec.high_mm[index])))
        case 7:
            session.desire(float(generator.uniform(*session.force_range)))
        case 8:
            (session.new_scene if generator.random() < 0.5 else session.straighten)()


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long), pytest.param(2, marks=pytest.mark.long)])
def test_any_order_of_inputs_is_played(seed):
    generator = np.random.default_rng(seed)
    session = Session(Choices(), seed=seed)
    for _ in range(100):
        random_input(session, generator)
        frame = run(session, 6)
        assert np.isfinite(frame.shape.nodes).all()
        assert np.isfinite([frame.numbers.true, frame.numbers.estimate, frame.numbers.residual]).all()
        assert frame.numbers.status in Status.__members__
