# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The settings of the site, for `make docs` and for rosdoc2.

rosdoc2 runs this file from a copy of docs/ elsewhere, so it names no path of the repository.
"""

import contextlib
import importlib

project = 'phase_traj_ros'
author = 'phase_traj_ros contributors'
copyright = f'2026, {author}'  # noqa: A001  # the name that Sphinx asks for

with contextlib.suppress(ImportError):  # rosdoc2 knows it from package.xml
    release = importlib.import_module(project).__version__

extensions = ['myst_parser', 'sphinx.ext.autodoc', 'sphinx.ext.napoleon']
# rosdoc2 adds an index.rst of its own; the first of these is taken.
source_suffix = {'.md': 'markdown', '.rst': 'restructuredtext'}

html_theme = 'sphinx_rtd_theme'
html_theme_options = {'navigation_depth': 3}
html_show_sourcelink = False

# Links to headings, as on the web sites that show Markdown.
myst_heading_anchors = 4

autodoc_member_order = 'bysource'
autodoc_typehints = 'signature'
# The attributes of a class are documented once, where its docstring lists them.
napoleon_use_ivar = True
napoleon_google_docstring = False
