"""Writes one Python source of all public names of btfield for Python, which the site's reference is read from.

    python3 docs/site/python_reference.py WHEEL FOLDER

The package has its names from a compiled module, whose stub the wheel holds, and from a few modules of its own.
"""

import ast
import pathlib
import sys
import zipfile


def named_in(tree):
    """Names that `from .MODULE import ...` takes of each module; '*' of the compiled one."""
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module:
            for alias in node.names:
                yield node.module, alias.name


def source_of(archive, module):
    names = set(archive.namelist())
    for name in (f"btfield/{module}.py", f"btfield/{module}.pyi"):
        if name in names:
            return archive.read(name).decode()
    sys.exit(f"the wheel has no source and no stub of btfield.{module}")


def write_reference(wheel, folder):
    with zipfile.ZipFile(wheel) as archive:
        package = ast.parse(archive.read("btfield/__init__.py").decode())
        wanted = {}
        for module, name in named_in(package):
            if not name.startswith("_"):
                wanted.setdefault(module, set()).add(name)
        imports, parts, found = [], [], set()
        for module, names in wanted.items():
            text = source_of(archive, module)
            for node in ast.parse(text).body:
                if isinstance(node, (ast.Import, ast.ImportFrom)) and getattr(node, "level", 0) == 0:
                    imports.append(ast.get_source_segment(text, node))
                name = getattr(node, "name", None)
                if name is None or not (name in names or ("*" in names and not name.startswith("_"))):
                    continue
                # Overloads repeat a name: all of them count.
                for decorator in getattr(node, "decorator_list", []):
                    parts.append("@" + ast.get_source_segment(text, decorator))
                parts.append(ast.get_source_segment(text, node) + "\n")
                found.add(name)
        missing = set().union(*wanted.values()) - found - {"*"}
        if missing:
            sys.exit(f"the wheel does not say what {', '.join(sorted(missing))} is")
    place = pathlib.Path(folder) / "btfield"
    place.mkdir(parents=True, exist_ok=True)
    head = f'"""{ast.get_docstring(package)}"""\n\n' + "\n".join(dict.fromkeys(imports)) + "\n\n"
    (place / "__init__.py").write_text(head + "\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    write_reference(*sys.argv[1:])
