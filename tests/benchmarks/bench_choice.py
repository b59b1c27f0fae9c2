"""S13 on a seed that is drawn at run time: each family of plants with one form of data; `make choice` has the rest."""

import secrets

from choice_cases import DATA, STATIC, case, equal, kinds
from choice_grid import MEDIAN, POOR, next_figures

from hystfmu.report.terminal import table


def s13(seed):
    rows = []
    for k, family in enumerate(dict.fromkeys(family for family, _ in STATIC)):
        form = list(DATA)[(seed + k) % len(DATA)]
        at, known = case(family, form, seed), {}
        for key in kinds(family):
            known[key] = next_figures(at, family, form, key, known)
        errors = {key: of["error"] for key, of in known.items() if key != "auto" and "error" in of}
        best, chosen = min(errors, key=errors.get), known["auto"]
        if "error" in chosen:
            ratio = max(chosen["error"], equal(family, form)) / max(errors[best], equal(family, form))
            told, verdict = f"{ratio:.2f} ({chosen['key']})", "met" if ratio <= MEDIAN else "MISSED"
        else:
            told, verdict = "refused", "met" if errors[best] > POOR else "MISSED"
        rows.append([f"{family}, {form}", f"<= {MEDIAN:g}", told, f"{best}, {errors[best]:.2g} %FS", verdict])
    print(f"\nS13  error of the chosen kind over that of the best one, seed {seed} (drawn)")
    print(table(["plant, data", "target", "figure", "best kind", "verdict"], rows))


if __name__ == "__main__":
    s13(secrets.randbelow(100_000))
