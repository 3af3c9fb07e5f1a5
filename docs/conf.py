"""Sphinx: the documents as a site. docs/build.sh puts the pages together and calls it."""

import os

project = "sim"
author = "the sim maintainers"
copyright = "2026, the sim maintainers"
release = version = os.environ.get("SIM_VERSION", "")
extensions = ["myst_parser"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "sim " + release
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
# Nothing is loaded from elsewhere: the site is read offline.
html_theme_options = {
    "source_repository": "",
    "light_css_variables": {"font-stack": "sans-serif"},
    # Debian's furo has no colours of its own for dark screens.
    "dark_css_variables": {
        "color-foreground-primary": "#dcdfe3",
        "color-foreground-secondary": "#9ca0a5",
        "color-foreground-muted": "#81868d",
        "color-foreground-border": "#666666",
        "color-background-primary": "#131416",
        "color-background-secondary": "#1a1c1e",
        "color-background-hover": "#1e2124",
        "color-background-hover--transparent": "#1e212400",
        "color-background-border": "#303335",
        "color-background-item": "#444444",
        "color-brand-primary": "#58a6f0",
        "color-brand-content": "#58a6f0",
        "color-highlighted-background": "#083563",
        "color-guilabel-background": "#08356380",
        "color-guilabel-border": "#13395f80",
        "color-admonition-background": "#18181a",
        "color-card-border": "#1a1c1e",
        "color-card-background": "#18181a",
    },
}
