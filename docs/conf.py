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
html_static_path = []
html_show_sphinx = False
html_copy_source = False
# Nothing is loaded from elsewhere: the site is read offline.
html_theme_options = {"source_repository": "", "light_css_variables": {"font-stack": "sans-serif"}}
