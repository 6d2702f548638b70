# SPDX-License-Identifier: BSD-3-Clause
"""An integrator of a user for generated equations with rigid contacts, which needs nothing of Kempe:

    kempe generate MODEL.yaml --lang python --drives --sets M_C+h_J+jdqd,contact,impact -o folder
    python3 contact_loop_numpy.py folder NAME STEP Q.. QD.. TIME..

Runge-Kutta steps of order 4 end at the times, whose states it prints, and where an open contact has no distance left or
a closed one no force: there it bisects. The contacts that touch strike together, by Newton's law. A contact closes
where its next flight would take less than 1e-6 s."""
import importlib
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv[1])
machine = importlib.import_module(sys.argv[2])

N, CLOSED, PLACE = len(machine.coordinate_names), 1, 2
modes = [0.0]*(machine.mode_entries*machine.elements)


def is_closed(c):
    return modes[machine.contact_modes[c] + CLOSED] > 0


def close(c, closed):
    modes[machine.contact_modes[c] + CLOSED] = float(closed)
    modes[machine.contact_modes[c] + PLACE] = 0.0


def solve(M, J, first, second):
    """M x - J' y = first, J x = second; the row of a contact that is open is zero: its y is zero then."""
    rows = len(J)
    matrix = np.block([[M, -J.T], [J, np.diag([0.0 if np.any(row) else 1.0 for row in J])]])
    solution = np.linalg.solve(matrix, np.concatenate([first, second]))
    return solution[:N], solution[N:N + rows]


def accelerate(t, q, qd):
    M, C, _, J, jdqd = machine.M_C_h_J_jdqd(t, q, qd, modes)
    return solve(M, J, -C, -jdqd)


def step(x, size):
    t, q, qd = x
    v, a, end, rate = qd, accelerate(*x)[0], q, qd
    for part, weight in ((0.5, 1/6), (0.5, 1/3), (1.0, 1/3), (0.0, 1/6)):
        end, rate = end + weight*size*v, rate + weight*size*a
        if part:
            at = (t + part*size, q + part*size*v, qd + part*size*a)
            v, a = at[2], accelerate(*at)[0]
    return t + size, end, rate


def left(x, c):
    """Negative where the contact changes."""
    gap, _, push = machine.contact(*x, accelerate(*x)[1], modes)
    return push[c] if is_closed(c) else gap[c]


def bounce(x, taking):
    """Rates after an impact of these contacts, without those whose impulse would pull; the rates that closures have."""
    t, q, qd = x
    while True:
        for c in range(len(machine.contact_names)):
            close(c, c in taking)
        M, _, _, J, _ = machine.M_C_h_J_jdqd(t, q, qd, modes)
        given = machine.impact(t, q, qd, modes)
        rates, impulse = solve(M, J, M @ qd, given)
        pulls = [c for c in taking if impulse[machine.contact_rows[c]] < 0]
        if not pulls:
            return M, J, given, rates
        taking.remove(min(pulls, key=lambda c: impulse[machine.contact_rows[c]]))


def strike(x, last):
    """The contacts that touch strike or stay closed; one without a flight of its own closes."""
    t, q, qd = x
    none = np.zeros(len(machine.row_names))
    gap, before, _ = machine.contact(t, q, qd, none, modes)
    taking = [c for c in range(len(gap)) if is_closed(c) or (gap[c] < 1e-9 and before[c] < 0)]
    M, J, given, rates = bounce(x, taking)
    after = machine.contact(t, q, rates, none, modes)[1]
    rest = machine.impact(t, q, rates, modes)
    for c in taking:
        row = machine.contact_rows[c]
        if before[c] < 0:
            print(f"impact {t:.17g}")
        if before[c] < 0 and after[c]/-before[c]*(t - last[c]) < 1e-6:
            given[row] = rest[row]
            print(f"close {t:.17g}")
        elif before[c] < 0:
            close(c, False)
            last[c] = t
    return solve(M, J, M @ qd, given)[0]


def main():
    size, *numbers = map(float, sys.argv[3:])
    x = (0.0, np.array(numbers[:N]), np.array(numbers[N:2*N]))
    contacts = range(len(machine.contact_names))
    last = [-np.inf for _ in contacts]
    for end in numbers[2*N:]:
        while x[0] < end:
            whole = min(size, end - x[0])
            after = step(x, whole)
            if all(left(after, c) >= 0 for c in contacts):
                x = (end, *after[1:]) if whole < size else after
                continue
            low, high = 0.0, whole
            while high - low > 1e-15:
                middle = (low + high)/2
                after = step(x, middle)
                if min(left(after, c) for c in contacts) < 0:
                    high = middle
                else:
                    low = middle
            x = step(x, high)
            for c in contacts:
                if is_closed(c) and left(x, c) < 0:
                    close(c, False)
                    print(f"open {x[0]:.17g}")
            x = (x[0], x[1], strike(x, last))
        print("state", *(f"{number:.17g}" for number in (x[0], *x[1], *x[2])))


main()
