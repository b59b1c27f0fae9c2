"""Uses an installed wheel once, outside the repository: fit, export, validate, a step."""

import sys
from pathlib import Path

import hystfmu as hy


def main() -> int:
    if Path(sys.prefix) not in Path(hy.__file__).parents:
        sys.exit(f"{hy.__file__} is not the wheel of this environment")
    model = hy.fit(hy.synthetic.piezo(20), "prandtl_ishlinskii")
    for fmi in (2, 3):
        file = model.export(f"piezo{fmi}.fmu", fmi=fmi)
        if problems := hy.validate(file):
            sys.exit("\n".join(problems))
    unit = model.unit()
    unit.initialize(0.0, u=1.5)
    unit.do_step(0.0, 1e-3)
    print(f"HystFMU {hy.__version__}: {model.key}, y(1.5) = {unit.get('y'):.6g}, both FMUs are valid")
    return 0


if __name__ == "__main__":
    sys.exit(main())
