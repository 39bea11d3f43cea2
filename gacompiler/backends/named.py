"""Kernels with arguments by name and a named tuple of results: a function around the kernel object."""

from __future__ import annotations

from .module import KernelSource


def named_lines(kernel: KernelSource) -> list[str]:
    """The lines after a kernel object; none where its results have no names.

    A kernel without arguments of its own has one that is not read; the function gives it.
    """
    names = kernel.result_names
    if not names:
        return []
    name = kernel.program.name
    used = [argument.name for argument in kernel.program.arguments]
    given = [] if kernel.is_constant else used
    fields = ", ".join(f'("{each}", Any)' for each in names)
    results = "".join(part.capitalize() if part.islower() else part for part in name.split("_")) + "Results"
    parameters = ", ".join(
        [*(f"{each}: Any" for each in given), "*", "out: Any = None", "num_threads: int | None = None"]
    )
    arguments = ", ".join([*(given or ["0.0"]), "out=out", "num_threads=num_threads"])
    star = "*" if len(names) > 1 else ""
    return [
        "",
        "",
        f"_{name}_kernel = {name}",
        f'{results} = NamedTuple("{results}", [{fields}])',
        "",
        "",
        f"def {name}({parameters}) -> Any:",
        f"    return {results}({star}_{name}_kernel({arguments}))",
        "",
        "",
        f'{name}.__doc__ = (_{name}_kernel.__doc__ or "").replace("``{name}.jit", "``{name}.kernel.jit")',
        f"{name}.kernel = _{name}_kernel  # type: ignore[attr-defined]",
        f"{name}.cost = _{name}_kernel.cost  # type: ignore[attr-defined]",
        f"{name}.layouts = {{  # type: ignore[attr-defined]",
        *(
            f'    "{each}": _{name}_kernel.layouts["{result.name}"],'
            for each, result in zip(names, kernel.program.results, strict=True)
        ),
        "}",
    ]
