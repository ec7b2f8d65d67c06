import re
import sys

import pytest

from agents import commands
from agents.command_line import LEARNERS, learner_first
from agents.config import EvaluateConfig, TrainConfig
from agents.errors import UserError
from agents.tuned import DistilledSettings, PPOSettings, SACSettings
from ccr_gym import __version__


@pytest.mark.parametrize(
    ("line", "run", "learner"),
    [
        ("train --steps 1000", "runs/ppo", PPOSettings(steps=1000)),
        ("train distilled --run x", "x", DistilledSettings()),
        ("train --run x distilled", "x", DistilledSettings()),
        ("train --steps 1000 distilled --run x", "x", DistilledSettings(steps=1000)),
        ("train --run x --steps 1000 distilled", "x", DistilledSettings(steps=1000)),
        ("train --restart sac --steps 1000", "runs/ppo", SACSettings(steps=1000)),
        ("train --run distilled --seed 2", "distilled", PPOSettings()),
        ("train --run=sac ppo", "sac", PPOSettings()),
    ],
)
def test_arguments_of_train_come_in_any_order(line, run, learner):
    config = commands.parse(line.split())
    assert isinstance(config, TrainConfig)
    assert (str(config.run), config.learner) == (run, learner)


COMMANDS = ("evaluate", "retrain", "sweep", "bench", "reproduce", "estimate", "play")


@pytest.mark.parametrize("command", [*COMMANDS, *(f"train {learner}" for learner in LEARNERS)])
def test_help_says_what_every_option_is_and_its_default(command, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit):
        commands.parse([*command.split(), "--help"])
    text = " ".join(re.sub("[│╭╮╰╯─]", " ", capsys.readouterr().out).split())
    options = re.split(r" (?=--[a-z][\w-]*[, ])", text.partition(" show this help message and exit ")[2])
    options = [option for option in options if not option.endswith(",")]  # of a switch, whose text is at its other form
    assert options
    for option in options[1:]:
        assert re.search(r"[.)\]:;,] \((default: [^ )][^)]*|required)\)", option), option


def test_arguments_of_other_commands_stay_where_they_are():
    arguments = ["evaluate", "--runs", "distilled", "ppo"]
    assert learner_first(arguments) == arguments
    config = commands.parse(arguments)
    assert isinstance(config, EvaluateConfig)
    assert [run.name for run in config.runs] == ["distilled", "ppo"]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("", r"expected one of \{train, .*, play\}; see ccr-gym --help"),
        ("bogus", "there is no command 'bogus'; it must be one of train, .*, play; see ccr-gym --help"),
        ("train --setps 9", r"unrecognized .*--setps.*; perhaps you meant --steps of ccr-gym train.*; see .*--help"),
        ("train --steps", "missing value for argument '--steps'.*; see ccr-gym train.* --help"),
        ("train --steps abc", "error parsing --steps: invalid literal for .*'abc'; see ccr-gym train --help"),
        ("train --sensing none", r"invalid choice 'none' for argument '--sensing'.*; see ccr-gym train.* --help"),
        ("evaluate --jobs 100000", r"jobs is 100000; it must be .*, 4 for each core.*; see ccr-gym evaluate --help"),
        ("retrain --jobs 100000", r"jobs is 100000; it must be .*, 4 for each core.*; see ccr-gym retrain --help"),
        ("train --envs 65537", "envs is 65537; it must be .* from 1 to 65536; see ccr-gym train --help"),
        ("evaluate --episodes 0", "episodes is 0; it must be .* at least 1; see ccr-gym evaluate --help"),
        ("estimate log.csv --robot r.json", "missing: --scene; see ccr-gym estimate --help"),
        ("estimate", "missing: PATH, --robot, --scene; see ccr-gym estimate --help"),
    ],
)
def test_errors_are_one_line(line, message, capsys):
    with pytest.raises(UserError, match=f"^{message}$") as caught:
        commands.parse(line.split())
    assert "\n" not in str(caught.value)
    assert capsys.readouterr().err == ""


def test_the_version_is_printed(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["ccr-gym", "--version"])
    with pytest.raises(SystemExit) as caught:
        commands.parse()
    assert caught.value.code is None
    assert capsys.readouterr().out == f"ccr-gym {__version__}\n"
