"""What a refusal names: every fragment in one line."""


def spoken(value: str) -> str:
    """A value as a line may show it: the spelling of numbers is free."""
    return value.lower().replace("+", "").replace("infinity", "inf").replace(".0", "").replace('"', "'")


def assert_names(line: str, *fragments: str) -> None:
    said = spoken(line)
    assert [fragment for fragment in fragments if spoken(fragment) not in said] == []
