/* SPDX-License-Identifier: BSD-3-Clause */
/* Frequencies w of K x = w^2 M x, by the eigenvalues 1/w^2 of L^-1 M L^-T, K = L L'. M of the body with its joint fixed
 * is tr T between coordinates. That of the free body is less F' I^-1 F, where F is the wrench that an acceleration of
 * each coordinate needs, and I the inertia of the rigid body. */
#include "model/flexible/body_spectrum.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/lapack.h"
#include <math.h>
#include <string.h>

/* Row k: force S_k and moment ax Z0_k about the origin. */
static void find_wrench(const kmp_flexible *f, int k, double wrench[6])
{
    const kmp_number *z = f->by_place + (ptrdiff_t)9 * k;
    for (int c = 0; c < 3; c++) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        wrench[c] = f->field[3 * k + c].value;
        wrench[3 + c] = z[3 * b + a].value - z[3 * a + b].value;
    }
}

/* The inertia about the origin that gives force and moment of accelerations of the origin and about it. */
static void find_inertia(const kmp_flexible *f, double inertia[36])
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    const double all = f->second[0].value + f->second[1].value + f->second[2].value;
    memset(inertia, 0, 36 * sizeof *inertia);
    for (int c = 0; c < 3; c++) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        const double s = f->moment[c].value;
        inertia[7 * c] = f->mass->value;
        inertia[7 * (3 + c)] = all;
        /* force o x s, moment s x a */
        inertia[b + 6 * (3 + a)] = inertia[3 + a + 6 * b] = -s;
        inertia[a + 6 * (3 + b)] = inertia[3 + b + 6 * a] = s;
    }
    for (int e = 0; e < 6; e++) {
        inertia[3 + row[e] + 6 * (3 + column[e])] -= f->second[e].value;
        if (row[e] != column[e])
            inertia[3 + column[e] + 6 * (3 + row[e])] -= f->second[e].value;
    }
}

/* values (n): 1/w^2, ascending. */
static bool find_values(int n, const double *stiffness, double *mass, double *values)
{
    kmp_cholesky_congruence(n, stiffness, mass);
    return kmp_symmetric_eigen(n, mass, values) == 0;
}

bool kmp_flexible_spectrum_find(const kmp_flexible *f, kmp_flexible_spectrum *s)
{
    const double small = KMP_FLEXIBLE_STILL;
    const int n = f->count, all = n + f->quadratic_count;
    double inertia[36], *stiffness = KMP_NEW(double, n *n), *mass[2] = {KMP_NEW(double, n *n), KMP_NEW(double, n *n)};
    double *wrench = KMP_NEW(double, 6 * n), *moved = KMP_NEW(double, 6 * n);
    double *values[2] = {KMP_NEW(double, n), KMP_NEW(double, n)};
    bool good = stiffness && mass[0] && mass[1] && wrench && moved && values[0] && values[1];
    *s = (kmp_flexible_spectrum){.count = n < KMP_OWN_FREQUENCIES ? n : KMP_OWN_FREQUENCIES};
    for (int k = 0; good && k < n; k++)
        find_wrench(f, k, wrench + (ptrdiff_t)6 * k);
    find_inertia(f, inertia);
    good = good && kmp_least_squares_of(6, 6, inertia, n, wrench, small, moved) >= 0;
    for (int k = 0; good && k < n * n; k++) {
        const int i = k % n, j = k / n;
        stiffness[k] = f->stiffness[k].value;
        const kmp_number *of = f->by_field + 9 * ((ptrdiff_t)all * i + j);
        mass[0][k] = mass[1][k] = of[0].value + of[4].value + of[8].value;
        for (int c = 0; c < 6; c++)
            mass[1][k] -= (wrench[6 * i + c] * moved[6 * j + c] + wrench[6 * j + c] * moved[6 * i + c]) / 2;
    }
    good = good && kmp_cholesky_factor(n, stiffness) == 0 && find_values(n, stiffness, mass[0], values[0]) &&
           find_values(n, stiffness, mass[1], values[1]);
    for (int k = 0; good && k < s->count; k++) {
        s->fixed[k] = 1 / sqrt(values[0][n - 1 - k]);
        s->free[k] = values[1][n - 1 - k] > small * values[1][n - 1] ? 1 / sqrt(values[1][n - 1 - k]) : INFINITY;
    }
    for (int k = 0; good && k < n && s->highest == 0; k++)
        if (values[1][k] > small * values[1][n - 1])
            s->highest = 1 / sqrt(values[1][k]);
    for (int k = 0; k < 2; k++) {
        kmp_free(mass[k]);
        kmp_free(values[k]);
    }
    kmp_free(stiffness);
    kmp_free(wrench);
    kmp_free(moved);
    return good;
}

double kmp_flexible_fastest(const kmp_flexible *f)
{
    kmp_flexible_spectrum s;
    if (f->count == 0 || (f->stiffening != KMP_STIFFENING_NONE && !f->averaged))
        return INFINITY;
    return kmp_flexible_spectrum_find(f, &s) ? s.fixed[0] * (f->averaged ? KMP_ROTATION_AVERAGED : 1) : INFINITY;
}
