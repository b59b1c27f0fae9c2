"""S13 on a seed that is drawn at run time: each family of plants with one form of data; `make choice` has the rest."""

import secrets

from choice_grid import DATA, FAMILIES, KINDS, MEDIAN, ORDER, POOR, Case, next_figures

from hystfmu.report.terminal import table


def s13(seed):
    rows = []
    for k, family in enumerate(FAMILIES):
        form = list(DATA)[(seed + k) % len(DATA)]
        case = Case(family, form, seed)
        known = {}
        for key in ORDER:
            known[key] = next_figures(case, key, known)
        errors = {key: known[key]["error"] for key in KINDS if "error" in known[key]}
        best, chosen = min(errors, key=errors.get), known["auto"]
        if "error" in chosen:
            ratio = chosen["error"] / errors[best]
            told, verdict = f"{ratio:.2f} ({chosen['key']})", "met" if ratio <= MEDIAN else "MISSED"
        else:
            told, verdict = "refused", "met" if errors[best] > POOR else "MISSED"
        rows.append([f"{family}, {form}", f"<= {MEDIAN:g}", told, f"{best}, {errors[best]:.2g} %FS", verdict])
    print(f"\nS13  error of the chosen kind over that of the best one, seed {seed} (drawn)")
    print(table(["plant, data", "target", "figure", "best kind", "verdict"], rows))


if __name__ == "__main__":
    s13(secrets.randbelow(100_000))
