"""Sphinx configuration; `make docs` builds the site, without network."""

project = "HystFMU"
author = "HystFMU authors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
add_module_names = False  # "Dataset", not "hystfmu.data.dataset.Dataset"
html_show_search_summary = False  # a summary is fetched, which a browser refuses for files
html_title = "HystFMU"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_copyright = False
html_show_sphinx = False
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 2
autodoc_typehints = "none"  # the docstrings state types
autodoc_member_order = "bysource"
napoleon_use_rtype = False
nitpicky = False
