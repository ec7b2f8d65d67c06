"""Steps that used to be given up on, though the robot has somewhere to go on to."""

import math
from dataclasses import replace

import pytest

from solver import Cable, Capsule, Circle, Ellipse, HalfPlane, Polygon, Robot, Scene, Solver, Status

PAPER = replace(Robot.prototype(model="paper"), model="paper", touch=("backbone", "cable"), between=0)
SMALL = replace(PAPER, length_mm=12.45, offset_mm=0.8, disk_radius_mm=0.8, rigidity=50.0, max_cable_mm=2.513)
SMALL = replace(SMALL, length_range_mm=(10.0, 18.0))
FED_PAST_A_BLADE = (
    Ellipse(center=(7.517, 5.66758), radii=(0.66, 8.712), axis=(0.9751439207111313, 0.2215724123173344)),
    Polygon(
        corners=(
            (3.363518041240354, 11.57050760433798),
            (4.497782885106401, 11.331425116989786),
            (5.15785557274211, 11.93461064053492),
            (4.99968110170852, 13.113350680076866),
            (3.720074786237231, 13.446416905073002),
            (3.003135788555102, 12.411362789763993),
        ),
        radius=0.01511475724277192,
    ),
)
DRAWN_BETWEEN_PEGS = (
    Circle(center=(2.386779520237013, 8.095214790533433), radius=0.6171250153226011),
    Capsule(
        start=(1.7953188807416158, 9.835437055995236),
        end=(1.553613436004829, 11.267362779405195),
        radius=0.542042387783304,
    ),
)
PULLED_OVER_A_CORNER = (
    Polygon(
        corners=(
            (66.74788547615796, 126.05682216139398),
            (76.57568776480407, 122.47405888079179),
            (84.78841132876629, 125.67356404852296),
            (89.6519022707869, 136.0134820803337),
            (86.08416841878844, 145.3360100775749),
            (74.39979787176121, 149.7013800648187),
            (67.23635244444719, 146.6254639700638),
            (62.322530053509, 135.8620832859514),
        ),
        radius=0.0009483398295753459,
    ),
    Ellipse(
        center=(53.46866839038217, 114.38317859160757),
        radii=(6.6, 28.525627101708725),
        axis=(0.3615523259858288, 0.9323518196336815),
    ),
)
LONG = replace(PAPER, segments=30, length_mm=105.2, length_range_mm=(100.0, 180.0))
SLIPS_OFF_A_SPRING = (
    HalfPlane(point=(61.628, 45.904), normal=(-0.8902905579278502, -0.4553929319439613)),
    Polygon(
        corners=(
            (59.87364471093608, 43.168565794657326),
            (70.3993359290978, 39.13445428967589),
            (83.59556146782822, 45.55624233737861),
            (86.89652826388443, 54.27214149863278),
            (80.32732579401737, 68.57342618453072),
            (72.33394986064602, 71.6849618306714),
            (60.34824701425899, 68.13922793410491),
            (54.405416064220915, 53.57592282651557),
        ),
        radius=2.3214772388822036,
        spring=0.21,
    ),
)
LARGE = replace(PAPER, length_mm=1676.343127396044, offset_mm=80.0, disk_radius_mm=80.0, rigidity=5e5, between=3)
LARGE = replace(LARGE, max_cable_mm=251.327, length_range_mm=(1000.0, 1800.0))
SLIDES_ALONG_A_FLANK = (
    Polygon(
        corners=(
            (134.70868600615677, 1315.0368484996463),
            (166.7954796181333, 1235.3807292101446),
            (246.24631093079446, 1237.6886993249088),
            (274.9924186778483, 1279.5691057954296),
            (254.6638859584454, 1349.3555124369368),
            (171.8264860238685, 1361.3830080272373),
        ),
        radius=16.88192974333283,
        spring=0.000607703944770859,
    ),
    Ellipse(
        center=(486.5765840815759, 1207.91292985501),
        radii=(19.33282508858494, 40.68970881155426),
        axis=(-0.9906865387486671, -0.13616233672416753),
    ),
)

ROD = Robot.prototype(
    **{"length_mm": 149.0, "length_range_mm": (100.0, 180.0), "max_cable_mm": 25.0},
    **{"touch": ("backbone", "cable", "rim"), "between": 3, "disk_radius_mm": 8.0},
)
FED_INTO_A_CHANNEL = (
    *(Circle(center=(-15.412, height), radius=5.335) for height in (61.248, 78.646, 96.045)),
    *(Circle(center=(15.178, height), radius=5.335) for height in (66.583, 101.38, 136.176, 153.575)),
    Circle(center=(30.531, 109.954), radius=7.507),
)


@pytest.mark.parametrize(
    ("robot", "scene", "commands"),
    [
        (SMALL, FED_PAST_A_BLADE, ((0.4446571028486126, 10.0), (0.5780542337031963, 16.32107474166508))),
        (
            SMALL,
            DRAWN_BETWEEN_PEGS,
            (
                (0.9147190718841882, 10.369013387571854),
                (1.0138508024400679, 17.610200131277423),
                (0.7344271906596117, 10.819696281678713),
                (0.63593875534001, 10.65334004581997),
            ),
        ),
        (
            PAPER,
            PULLED_OVER_A_CORNER,
            ((11.760266471349633, None), (12.321153669669558, None), (12.487393185968, None)),
        ),
        (LARGE, SLIDES_ALONG_A_FLANK, ((50.365, 1606.145), (156.166, 1588.997), (58.124, 1576.662))),
        (LARGE, SLIDES_ALONG_A_FLANK[:1], ((49.54, 1467.42), (106.69, 1462.54))),
        (ROD, FED_INTO_A_CHANNEL, ((4.2, 100.0), (0.8, 158.6))),
        (LONG, SLIPS_OFF_A_SPRING, ((16.684440648566614, 174.86340406235342), (6.810434947841618, 176.34558792448638))),
    ],
    ids=[
        "no penalty shows that it is stable",
        "pegs hold it far from its free shape",
        "a step beyond a corner",
        "a link lies flush on a flank",
        "four points of a link do",
        "a step along which the energy rises",
        "its segments shear one after another",
    ],
)
def test_not_given_up(robot, scene, commands):
    solver = Solver(robot, Scene(scene))
    equilibrium = solver.rest()
    for command in commands:
        equilibrium = solver.step(equilibrium, *(part for part in command if part is not None))
        assert equilibrium.status is not Status.GAVE_UP
        residuals = equilibrium.residuals()
        assert max(residuals.stationarity, residuals.lengths, residuals.gaps, residuals.complementarity) <= 1e-8


def test_a_cable_that_is_as_short_as_it_can_be_stalls_at_its_limit():
    """It ends at the second disk: where these meet, its motor pulls against them, whatever else touches the robot."""
    cables, lines = (Cable(end=2), Cable(angle=math.pi)), ("backbone", "cable")
    robot = Robot.prototype(max_tension=100.0, cables=cables, touch=lines, disk_radius_mm=8.0, max_cable_mm=25.13)
    circles = (((58.84, 122.16), 15.46), ((67.85, 93.05), 10.26), ((57.84, 84.75), 14.28))
    solver = Solver(robot, Scene(Circle(center=center, radius=radius) for center, radius in circles))
    state = solver.rest()
    for command in ((16.98, 9.03), (18.5, -2.09), (19.97, -21.56), (20.93, -25.13)):
        state = solver.step(state, command)
    assert state.contact.any()
    assert state.status is Status.STALLED
    assert state.cables_mm[0] == pytest.approx(2 * robot.segment_mm, abs=1e-6)
    assert state.tensions[0] == pytest.approx(100.0, rel=1e-5)
    assert max(solver.optimality(state)) < 1e-8
