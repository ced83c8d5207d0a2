"""What axe-core finds on a page in a browser."""

from axe_playwright_python.sync_playwright import Axe

GRAVE = ("serious", "critical")


def findings(page):
    """What keeps people with disabilities from using it: the rule and the first place of each."""
    found = Axe().run(page).response["violations"]
    return [
        f"{page.url}: {one['id']}: {one['nodes'][0]['html']}: {one['nodes'][0]['failureSummary']}"
        for one in found
        if one["impact"] in GRAVE
    ]
