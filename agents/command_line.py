"""Arguments of the command line in any order, and their errors in one line."""

import re

LEARNERS = ("ppo", "sac", "recurrent", "distilled")
SWITCHES = ("--restart", "--no-restart")  # arguments of train that take no value


def learner_first(arguments: list[str]) -> list[str]:
    """Return arguments with the learner of ``train`` before its settings, wherever it was given."""
    if arguments[:1] != ["train"]:
        return arguments
    for k, word in enumerate(arguments[1:], start=1):
        before = arguments[k - 1]
        is_value = before.startswith("--") and "=" not in before and before not in SWITCHES
        if word in LEARNERS and not is_value:
            return ["train", word, *arguments[1:k], *arguments[k + 1 :]]
    return arguments


def one_line(box: str, arguments: list[str]) -> str:
    """Return the message of a box that tyro draws: what is wrong, what was perhaps meant, and where help is."""
    parts = re.split("[─-]{9,}", re.sub(r"[│╭╮╰╯]|\x1b\[[\d;]*m", " ", box))  # rules are ASCII on some terminals
    title, *contents = [text for part in parts if (text := " ".join(part.split()).strip("─ "))]
    text = " ".join(contents)
    meant = re.search(r"Perhaps you meant: (--[\w-]+).*? in (ccr-gym[\w -]*?) --help", text)
    page = re.search(r"For full helptext, (?:run|see):? (ccr-gym[\w -]*?) --help", text)
    where = page[1] if page else "ccr-gym"
    if where == "ccr-gym" and arguments and f"options: {arguments[0]}" not in text:
        where = f"ccr-gym {arguments[0]}"
    said = [_message(contents[0] if contents else title)]
    said += [f"perhaps you meant {meant[1]} of {meant[2]}"] if meant else []
    return "; ".join([*said, f"see {where} --help"])


def _message(text: str) -> str:
    """Return the first paragraph of a box without what a line has no room for."""
    if text.startswith("Missing from"):
        return f"missing: {', '.join(re.findall(r'--[a-z][a-z-]*|(?<=: )[A-Z]+(?= )', text))}"
    text = re.sub(r"^Error parsing (?!-)\S+: | \(applied to [^)]*\)| Arguments are applied to.*", "", text).rstrip(".")
    return text if re.match(r"\w+_", text) else text[:1].lower() + text[1:]
