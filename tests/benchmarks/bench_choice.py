"""S13 on a seed that is drawn at run time: each family of plants with one form of data; `make choice` has the rest."""

import secrets

from choice_cases import DATA, STATIC, case, kinds
from choice_grid import next_figures
from choice_page import MEDIAN, errors, ratio

from hystfmu.report.terminal import table


def s13(seed):
    rows = []
    for k, family in enumerate(dict.fromkeys(family for family, _ in STATIC)):
        form = list(DATA)[(seed + k) % len(DATA)]
        at, known = case(family, form, seed), {}
        for key in kinds(family):
            known[key] = next_figures(at, family, form, key, known)
        found, over = errors(known), ratio((family, form), known)
        best = min(found, key=found.get)
        told = "refused" if "refused" in known["auto"] else f"{over:.2f} ({known['auto']['key']})"
        verdict = "MISSED" if over > MEDIAN else "met"  # nan for a refusal that counts
        rows.append([f"{family}, {form}", f"<= {MEDIAN:g}", told, f"{best}, {found[best]:.2g} %FS", verdict])
    print(f"\nS13  error of the chosen kind over that of the best one, seed {seed} (drawn)")
    print(table(["plant, data", "target", "figure", "best kind", "verdict"], rows))


if __name__ == "__main__":
    s13(secrets.randbelow(100_000))
