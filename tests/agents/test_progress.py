from agents.progress import followed


def test_a_line_is_printed_for_each_item_where_there_is_no_terminal(capsys):
    assert list(followed(iter("ab"), "evaluate", 2)) == ["a", "b"]
    assert capsys.readouterr().out == "evaluate: 1 of 2\nevaluate: 2 of 2\n"


def test_a_bar_is_shown_on_a_terminal(monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert list(followed(iter("ab"), "evaluate", 2)) == ["a", "b"]
    assert "100%" in capsys.readouterr().out
