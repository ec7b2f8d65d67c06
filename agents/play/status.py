"""The numbers of a step as HTML."""

import html

from agents.play.frame import Numbers

GOOD, BAD = "#008c7e", "#d01842"
MILLI = 1e3


def status_html(numbers: Numbers, contacts: int, ticks: int) -> str:
    """Return the numbers of a step as HTML."""
    good = numbers.status in ("CONVERGED", "SNAPPED")
    tensions = " ".join(f"{tension:.2f}" for tension in numbers.tensions)
    rows = [
        ("status", f'<b style="color:{GOOD if good else BAD}">{numbers.status}</b>, step {numbers.step}'),
        ("contacts", f'<b style="color:{BAD if contacts else "inherit"}">{contacts}</b>'),
        ("desired force", f'{MILLI * numbers.desired:.1f} mN <b style="color:#703eb8">&#9632;</b>'),
        ("true force", f'<span id="ccr-true">{MILLI * numbers.true:.1f}</span> mN <b style="color:{GOOD}">&#9632;</b>'),
        ("estimated force", f'{MILLI * numbers.estimate:.1f} mN <b style="color:#f4921e">&#9632;</b>'),
        ("tension", f"{tensions} N"),
        ("residual", f"{numbers.residual:.1e}"),
        ("reward", f"{numbers.reward:.3f}"),
    ]
    cells = "".join(f"<tr><td style='padding-right:1em;opacity:.65'>{name}</td><td>{v}</td></tr>" for name, v in rows)
    return (
        f'<div id="ccr-status" data-tick="{ticks}" data-contacts="{contacts}" '
        'style="padding:.3em .8em;font-size:.82em;line-height:1.35">'
        f'<table>{cells}</table><div style="min-height:3.9em;color:{BAD}">{html.escape(numbers.message)}</div></div>'
    )
