"""The site: README, what docs/README.md lists, and nothing from elsewhere. `make docs` builds it."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

project = "ringbalance"
author = "The ringbalance developers"
root_doc = "README"
include_patterns = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/**.md"]
extensions = ["myst_parser", "documentation_site"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
nitpicky = True
html_theme = "furo"
html_title = "ringbalance"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "typeset"
html_show_sourcelink = False
html_copy_source = False
html_show_copyright = False
