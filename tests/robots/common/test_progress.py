from robots.common.progress import SILENT, Progress


def test_silent_listener_takes_every_call_and_says_nothing(capsys):
    """The default listener follows the protocol and writes nothing."""
    SILENT.start("design", 10.0)
    SILENT.start("search")
    SILENT.update(3.0)
    SILENT.update(4.0, "cond 12.3")
    SILENT.finish()
    assert capsys.readouterr() == ("", "")
    assert repr(SILENT) == "SILENT"


def test_any_object_with_the_three_calls_is_a_listener():
    """A listener needs no base class."""

    class Bar:
        def start(self, task, total=None): ...
        def update(self, done, note=""): ...
        def finish(self): ...

    assert isinstance(Bar(), Progress)
    assert isinstance(SILENT, Progress)
    assert not isinstance(object(), Progress)
