"""Uses an installed wheel once, outside the repository: fit, export, validate, a step, a shipped scenario."""

import sys
from pathlib import Path

import hystfmu
from hystfmu import Unit
from hystfmu.data.synthetic import piezo
from hystfmu.fmu.check.check import check_fmu
from hystfmu.fmu.write.export import export_fmu
from hystfmu.identify import fit


def main() -> int:
    if Path(sys.prefix) not in Path(hystfmu.__file__).parents:
        sys.exit(f"{hystfmu.__file__} is not the wheel of this environment")
    model = fit(piezo(20), "prandtl_ishlinskii")
    for fmi in (2, 3):
        file = export_fmu(model, f"piezo{fmi}.fmu", fmi=fmi)
        if problems := check_fmu(file):
            sys.exit("\n".join(problems))
    unit = Unit(model.graph)
    unit.initialize(0.0, u=1.5)
    unit.do_step(0.0, 1e-3)
    print(f"HystFMU {hystfmu.__version__}: {model.key}, y(1.5) = {unit.get('y'):.6g}, both FMUs are valid")
    return 0


if __name__ == "__main__":
    sys.exit(main())
