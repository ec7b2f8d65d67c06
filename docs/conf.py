"""Configuration of Sphinx; ``make docs`` builds the pages to ``build/docs``."""

import sys
from pathlib import Path

from ccr_gym import __version__

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

project = "ccr-gym"
author = "The ccr-gym authors"
copyright = "The ccr-gym authors"
version = release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "environment_pages",
    "api_pages",
]
exclude_patterns = ["_extensions"]
suppress_warnings = ["myst.header"]  # the benchmark page, which `ccr-gym evaluate` writes, skips a level
myst_enable_extensions = ["attrs_inline", "colon_fence"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_class_signature = "mixed"
autodoc_default_options = {"members": True, "inherited-members": "ABC,Env,VectorEnv,VecEnv,tuple,int,Generic,Protocol"}
autodoc_preserve_defaults = True
napoleon_use_ivar = True
napoleon_numpy_docstring = False
default_role = "literal"
python_display_short_literal_types = True
python_use_unqualified_type_names = True
add_module_names = False

html_theme = "furo"
html_title = f"ccr-gym {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
