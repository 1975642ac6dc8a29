"""A widget on a page, for tests in a browser: its parts, and its sliders moved."""

import re


def frame(browser, name):
    return browser.find_element("css selector", f"[data-widget={name}]")


def says(browser, name):
    return frame(browser, name).find_element("css selector", ".says").text


def move(browser, name, slider, value):
    browser.execute_script(
        "const i = document.querySelector(`[data-widget=${arguments[0]}] input[name=${arguments[1]}]`);"
        "i.value = arguments[2]; i.dispatchEvent(new Event('input'));",
        name,
        slider,
        value,
    )


def place(browser, name, data, positions):
    """Move all sliders of a widget made of scenes."""
    for slider, position in zip(data["sliders"], positions, strict=True):
        move(browser, name, slider["name"], position)


def drawn(chart):
    """The tags of the marks of a chart."""
    return [mark.tag_name for mark in chart.find_elements("css selector", ":scope > g:last-child > *")]


def rows(browser, name):
    table = frame(browser, name).find_element("css selector", "table").get_attribute("innerHTML")
    return [re.findall(r"<td>(.*?)</td>", row) for row in table.split("<tr>") if "<td>" in row]
