"""Builds the documentation: `sphinx-build assets/docs build/docs`, after `pip install -e '.[docs]'`.

The pages need no network to be read: formulas become MathML, and the theme brings its own files.
"""

import re
import shutil
import sys
from pathlib import Path
from tempfile import mkdtemp

from docutils import nodes
from docutils.parsers.rst import Directive
from latex2mathml.converter import convert

ROOT = Path(__file__).resolve().parents[2]
GALLERY = Path(mkdtemp()) / "gallery"
"""A copy: its programs write their files beside themselves."""
shutil.copytree(Path(__file__).parent / "gallery", GALLERY, ignore=shutil.ignore_patterns("__pycache__"))
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

project = "workbench"
author = "the workbench authors"
copyright = "the workbench authors, Apache License 2.0"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_gallery.gen_gallery"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
exclude_patterns = ["gallery"]
html_theme = "furo"
html_title = "workbench"
html_static_path = ["pages.css"]
html_css_files = ["pages.css"]
html_math_renderer = "mathml"
html_copy_source = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_use_rtype = False
default_role = "literal"
sphinx_gallery_conf = {
    "examples_dirs": str(GALLERY),
    "gallery_dirs": "examples",
    "filename_pattern": r"/\d\d_",
    "within_subsection_order": "FileNameSortKey",
    "ignore_repr_types": r"_Drawing",
    "default_thumb_file": str(ROOT / "assets" / "pictures" / "identify.png"),
    "write_computation_times": False,
    "remove_config_comments": True,
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 1000.0,
}


def _mathml(block: bool):
    """Writes a formula as MathML, which browsers draw by themselves."""

    def visit(writer, node):
        formula = convert(node.astext(), display="block" if block else "inline")
        writer.body.append(
            f'<div class="math" style="overflow-x: auto">{formula}</div>' if block else formula
        )
        raise nodes.SkipNode

    return visit, None


class Commands(Directive):
    """The help of every command of a section."""

    required_arguments = 1

    def run(self):
        """One entry for every command."""
        import typer

        from workbench.cli import app

        group = typer.main.get_command(app).whole
        context = group.make_context("workbench", [], resilient_parsing=True)
        section = self.arguments[0]
        return [
            self._entry(f"workbench {name}", group.resolve_command(context, [name])[1])
            for name, command in group.commands.items()
            if command.rich_help_panel == section
        ]

    def _entry(self, name, command):
        """A command's help; those of a group one below the other."""
        import typer

        context = command.make_context(name, [], resilient_parsing=True, max_content_width=88)
        context.terminal_width = 88
        section = nodes.section(ids=[nodes.make_id(name)])
        section += nodes.title(text=name)
        inner = command.whole.commands if hasattr(command, "whole") else {}
        if inner and isinstance(command, typer.core.TyperGroup):
            section += nodes.paragraph(text=command.help or "")
            for word, entry in inner.items():
                section += self._entry(f"{name} {word}", entry)
        else:
            section += nodes.literal_block(text=command.get_help(context), language="text")
        return section


def readable(_app, _what, _name, _object, _options, signature, answer):
    """A signature with defaults as people write them: rounded numbers, functions by name, `…` for made ones."""
    if signature is None:
        return None
    text = re.sub(r"np\.float64\(([\d.e-]+)\)", r"\1", signature)
    text = re.sub(r"\d\.\d{6,}", lambda number: f"{float(number[0]):.3g}", text)
    return re.sub(r"<function (\w+)>", r"\1", text).replace("<factory>", "…"), answer


def setup(app):
    """Add the directive of commands, the writer of formulas, and readable signatures."""
    app.add_directive("commands", Commands)
    app.connect("autodoc-process-signature", readable)
    app.add_html_math_renderer("mathml", _mathml(False), _mathml(True))
