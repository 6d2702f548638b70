/* SPDX-License-Identifier: BSD-3-Clause */
/* First order: r1' = theta x e1 + gamma. Second order, of the rod r' = R (e1 + gamma), R' = R theta~' that is
 * inextensible where gamma is zero: R2 = theta~(0)^2/2 + int theta~ theta~', r2' = R2 e1 + theta x gamma, symmetrised
 * (Antman 2005, chapter 8). Angles about x, y and z of R_z R_y R_x: theta + ax(R2)/2 + (theta_2 theta_3, -theta_1
 * theta_3, theta_1 theta_2)/2. */
#include "model/flexible/beam_fields.h"
#include "linalg/dense/dense.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* -- fields ------------------------------------------------------------------------------------------ */

/* The part of a product of two parts; -1: none. */
static int part_of(int i, int j)
{
    static const int part[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    return i == 0 ? j : j == 0 ? i : i < 3 && j < 3 ? part[i][j] : -1;
}

/* to = to + factor * field */
static void field_add(kmp_beam_field *to, double factor, const kmp_beam_field *field)
{
    for (int i = 0; i < KMP_BEAM_PARTS; i++)
        kmp_polynomial_add(&to->part[i], factor, &field->part[i]);
}

/* to = to + factor * a b, a and b without squares of s. */
static void field_add_product(kmp_beam_field *to, double factor, const kmp_beam_field *a, const kmp_beam_field *b)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3 && a->part[i].count > 0; j++) {
            kmp_polynomial product = kmp_polynomial_product(&a->part[i], &b->part[j]);
            kmp_polynomial_add(&to->part[part_of(i, j)], factor, &product);
        }
}

static void field_differentiate(kmp_beam_field *field)
{
    for (int i = 0; i < KMP_BEAM_PARTS; i++)
        field->part[i] = kmp_polynomial_derivative(&field->part[i]);
}

/* From xi = 0. */
static void field_integrate(kmp_beam_field *field)
{
    for (int i = 0; i < KMP_BEAM_PARTS; i++)
        field->part[i] = kmp_polynomial_integral(&field->part[i]);
}

void kmp_beam_field_cut(kmp_beam_field *field, double from)
{
    for (int i = 0; i < KMP_BEAM_PARTS; i++)
        field->part[i] = kmp_polynomial_part(&field->part[i], from, 1);
}

kmp_beam_amount kmp_beam_field_mean(const kmp_beam_field *a, const kmp_beam_field *b, const kmp_taper_share *share)
{
    kmp_beam_amount sum = {{0}};
    for (int i = 0; i < KMP_BEAM_PARTS; i++)
        for (int j = 0; j < KMP_BEAM_PARTS; j++)
            if (part_of(i, j) >= 0)
                sum.part[part_of(i, j)] += kmp_taper_share_mean(share, &a->part[i], &b->part[j]);
    return sum;
}

kmp_beam_amount kmp_beam_field_mean_with(const kmp_beam_field *a, const kmp_polynomial *b, const kmp_taper_share *share)
{
    kmp_beam_amount sum = {{0}};
    for (int i = 0; i < KMP_BEAM_PARTS; i++)
        sum.part[i] = kmp_taper_share_mean(share, b, &a->part[i]);
    return sum;
}

/* -- shapes ------------------------------------------------------------------------------------------ */

/* Bending by a rotation that is the slope of `own`, with the quasi-static strain -s own''' of the shear force and, in
 * the frame of the chord, less the rotation that its deflection at the far end is. */
static void bend(const kmp_beam *beam, int plane, const kmp_polynomial *own, kmp_beam_field *turn,
                 kmp_beam_field *strain)
{
    turn->part[0] = kmp_polynomial_derivative(own);
    if (!beam->sheared)
        return;
    kmp_polynomial second = kmp_polynomial_derivative(&turn->part[0]), third = kmp_polynomial_derivative(&second);
    kmp_polynomial_add(&strain->part[1 + plane], -1, &third);
    if (beam->frame == KMP_FRAME_CHORD) {
        double rise = kmp_polynomial_at(&second, 1) - kmp_polynomial_at(&second, 0);
        kmp_polynomial_add(&turn->part[1 + plane], rise, &(kmp_polynomial){.count = 1, .c = {1}});
    }
}

/* The field of a shape in the beam's frame. */
static kmp_beam_shape shape_of(const kmp_beam *beam, kmp_beam_family family, const kmp_polynomial *own)
{
    kmp_beam_shape s = {.family = family, .own = *own};
    if (family == KMP_BEAM_Y) {
        bend(beam, 0, own, &s.turn[2], &s.strain[1]);
    } else if (family == KMP_BEAM_Z) {
        kmp_beam_field slope = {0};
        bend(beam, 1, own, &slope, &s.strain[2]);
        field_add(&s.turn[1], -1, &slope);
    } else if (family == KMP_BEAM_TORSION) {
        s.turn[0].part[0] = *own;
    } else {
        s.strain[0].part[0] = kmp_polynomial_derivative(own);
    }
    for (int c = 0; c < 3; c++)
        field_add(&s.way[c], 1, &s.strain[c]);
    field_add(&s.way[1], 1, &s.turn[2]);
    field_add(&s.way[2], -1, &s.turn[1]);
    for (int c = 0; c < 3; c++)
        field_integrate(&s.way[c]);
    if (beam->frame == KMP_FRAME_MEAN && family != KMP_BEAM_TORSION)
        s.way[family == KMP_BEAM_AXIAL ? 0 : 1 + (int)family].part[0] = *own;
    return s;
}

/* The factor of all polynomials of a family that makes them fit the frame. */
static kmp_polynomial frame_factor(const kmp_beam *beam, kmp_beam_family family)
{
    const kmp_polynomial one = {.count = 1, .c = {1}};
    kmp_polynomial place = kmp_polynomial_times_place(&one), square = kmp_polynomial_times_place(&place);
    if (family == KMP_BEAM_TORSION || family == KMP_BEAM_AXIAL)
        return place;
    if (beam->frame == KMP_FRAME_CLAMPED)
        return square;
    kmp_polynomial_add(&place, -1, &square);
    return place;
}

/* Of a shape in mean axes the degree of the first polynomial, above the degrees of rigid motions. */
static int first_degree(kmp_beam_family family)
{
    return family == KMP_BEAM_TORSION || family == KMP_BEAM_AXIAL ? 1 : 2;
}

/* The polynomial number k of a family as they are written: xi^2 and on, xi (1 - xi) (2 xi - 1)^k, (xi - 1/2)^(k + 1)
 * less its start, xi and on; in mean axes (2 xi - 1)^2 and on, or (2 xi - 1) and on. */
static kmp_polynomial monomial(const kmp_beam *beam, kmp_beam_family family, int k)
{
    bool chord = beam->frame == KMP_FRAME_CHORD, twist = chord && family == KMP_BEAM_TORSION;
    kmp_polynomial made = twist ? (kmp_polynomial){.count = 1, .c = {1}} : frame_factor(beam, family);
    const kmp_polynomial step = {.count = 2, .c = {0, twist ? 0.5 : 1}}; /* xi - 1/2, or 2 xi - 1 */
    if (beam->frame == KMP_FRAME_MEAN) {
        made = (kmp_polynomial){.count = 1, .c = {1}};
        for (int i = 0; i < k + first_degree(family); i++)
            made = kmp_polynomial_product(&step, &made);
        return made;
    }
    for (int i = 0; i < k + twist; i++)
        made = chord && family != KMP_BEAM_AXIAL ? kmp_polynomial_product(&step, &made)
                                                 : kmp_polynomial_times_place(&made);
    if (twist) {
        const kmp_polynomial start = {.count = 1, .c = {kmp_polynomial_at(&made, 0)}};
        kmp_polynomial_add(&made, -1, &start);
    }
    return made;
}

/* -- modes ------------------------------------------------------------------------------------------- */

/* Modes are made twice: of Legendre polynomials, and of the modes that these are, whose matrices are nearly diagonal
 * and have small relative errors. Rotations of Jacobi keep these (Demmel and Veselic 1992), and keep what is even apart
 * from what is odd. */

static double field_value_mean(const kmp_beam_field *a, const kmp_beam_field *b, const kmp_taper_share *share,
                               const double s[2])
{
    const kmp_beam_amount m = kmp_beam_field_mean(a, b, share);
    const double *p = m.part;
    return p[0] + p[1] * s[0] + p[2] * s[1] + p[3] * s[0] * s[0] + p[4] * s[0] * s[1] + p[5] * s[1] * s[1];
}

/* The value of the term of degree j by the value of a scale. */
static double part_of_term(const kmp_taper *taper, int j, double scale)
{
    return j < taper->count ? taper->c[j].value / scale : 0;
}

/* The mass between two shapes by the mean mass by length * length, with the rotary inertia of the sections. */
static double mass_between(const kmp_beam *beam, const double s[2], const kmp_beam_shape *a, const kmp_beam_shape *b)
{
    const double mass = beam->line_mass.c[0].value, scale = mass * beam->length.value * beam->length.value;
    const kmp_taper *line = &beam->line_mass, *section[2] = {&beam->section_mass[0], &beam->section_mass[1]};
    kmp_taper_share share = {.to = 0};
    double sum = 0;
    for (; line; line = line->next) { /* with the same pieces */
        share.from = share.to;
        share.to = line->next ? line->end : 1;
        for (share.degree = 0; share.degree < KMP_TAPER_TERMS; share.degree++) {
            const double of_line = part_of_term(line, share.degree, mass);
            const double of_section[2] = {part_of_term(section[0], share.degree, scale),
                                          part_of_term(section[1], share.degree, scale)};
            const double about[3] = {of_section[0] + of_section[1], of_section[1], of_section[0]};
            for (int c = 0; c < 3; c++) {
                const double way = of_line == 0 ? 0 : of_line * field_value_mean(&a->way[c], &b->way[c], &share, s);
                const double turn =
                    about[c] == 0 ? 0 : about[c] * field_value_mean(&a->turn[c], &b->turn[c], &share, s);
                sum += way + turn;
            }
        }
        for (int k = 0; k < 2; k++)
            section[k] = section[k]->next ? section[k]->next : section[k];
    }
    return sum;
}

/* The integral of u w by the stiffness of a family over its mean in the first piece. */
static double stiff_mean(const kmp_taper *stiffness, const kmp_polynomial *u, const kmp_polynomial *w)
{
    double sum = 0;
    for (int k = 0; k < kmp_taper_shares(stiffness); k++) {
        const kmp_taper_share share = kmp_taper_share_of(stiffness, k);
        sum += share.c.value / stiffness->c[0].value * kmp_taper_share_mean(&share, u, w);
    }
    return sum;
}

static double stiffness_between(const kmp_beam *beam, const double s[2], const kmp_beam_shape *a,
                                const kmp_beam_shape *b)
{
    kmp_polynomial u = kmp_polynomial_derivative(&a->own), w = kmp_polynomial_derivative(&b->own);
    if (a->family == KMP_BEAM_TORSION || a->family == KMP_BEAM_AXIAL)
        return stiff_mean(&beam->stiffness[a->family], &u, &w);
    u = kmp_polynomial_derivative(&u);
    w = kmp_polynomial_derivative(&w);
    double sum = stiff_mean(&beam->stiffness[a->family], &u, &w);
    u = kmp_polynomial_derivative(&u);
    w = kmp_polynomial_derivative(&w);
    return beam->sheared ? sum + s[a->family] * kmp_polynomial_mean(&u, &w) : sum;
}

/* A rotation that makes a[i][j] zero, of a symmetric matrix and of the columns of x. */
static void rotate(int n, double *a, double *x, int i, int j)
{
    double half = (a[j + n * j] - a[i + n * i]) / (2 * a[i + n * j]);
    double t = (half < 0 ? -1 : 1) / (fabs(half) + sqrt(half * half + 1)), c = 1 / sqrt(t * t + 1), s = t * c;
    double across = a[i + n * j];
    for (int k = 0; k < n; k++) {
        double u = a[k + n * i], w = a[k + n * j];
        if (k != i && k != j) {
            a[k + n * i] = a[i + n * k] = c * u - s * w;
            a[k + n * j] = a[j + n * k] = s * u + c * w;
        }
        u = x[k + n * i], w = x[k + n * j];
        x[k + n * i] = c * u - s * w;
        x[k + n * j] = s * u + c * w;
    }
    a[i + n * i] -= t * across;
    a[j + n * j] += t * across;
    a[i + n * j] = a[j + n * i] = 0;
}

bool kmp_beam_modes(int n, double *stiffness, double *mass, double *x, double *values)
{
    double kept[KMP_BEAM_MOST * KMP_BEAM_MOST] = {0};
    int order[KMP_BEAM_MOST];
    if (kmp_cholesky_factor(n, stiffness) != 0)
        return false;
    kmp_cholesky_congruence(n, stiffness, mass);
    for (int i = 0; i < n; i++)
        kept[i + n * i] = 1;
    /* Makes a diagonal and positive matrix of a, whose columns were the columns of x. */
    enum { SWEEPS = 60 }; /* they converge quadratically, in less than ten */
    bool on = true;
    for (int sweep = 0; sweep < SWEEPS && on; sweep++) {
        on = false;
        for (int i = 0; i < n; i++)
            for (int j = i + 1; j < n; j++)
                if (fabs(mass[i + n * j]) > DBL_EPSILON * sqrt(fabs(mass[i + n * i] * mass[j + n * j]))) {
                    rotate(n, mass, kept, i, j);
                    on = true;
                }
    }
    for (int k = 0; k < n; k++) {
        int at = k;
        for (; at > 0 && mass[order[at - 1] * (n + 1)] < mass[k * (n + 1)]; at--)
            order[at] = order[at - 1];
        order[at] = k;
    }
    for (int k = 0; k < n; k++) {
        values[k] = mass[order[k] * (n + 1)];
        memcpy(x + (ptrdiff_t)n * k, kept + (ptrdiff_t)n * order[k], (size_t)n * sizeof *x);
        kmp_cholesky_backward(n, stiffness, x + (ptrdiff_t)n * k);
    }
    return true;
}

/* The signed value of a field where it is largest; of equal ones the one with the least xi. */
static double peak_of(const kmp_polynomial *p)
{
    enum { PLACES = 256 };
    const double equal = 1e-6, step = 1.0 / PLACES;
    double best = 0, at = 0;
    for (int i = 0; i <= PLACES; i++) {
        double value = kmp_polynomial_at(p, i * step);
        if (fabs(value) > fabs(best) * (1 + equal)) {
            best = value;
            at = i * step;
        }
    }
    kmp_polynomial slope = kmp_polynomial_derivative(p), curvature = kmp_polynomial_derivative(&slope);
    for (int i = 0; i < 5 && at > 0 && at < 1; i++) {
        double bend_there = kmp_polynomial_at(&curvature, at), move = kmp_polynomial_at(&slope, at) / bend_there;
        at = isfinite(move) && fabs(move) < step ? at - move : at;
    }
    double refined = at >= 0 && at <= 1 ? kmp_polynomial_at(p, at) : best;
    return fabs(refined) > fabs(best) ? refined : best;
}

/* The field that the coordinate of a shape measures, at these values of s. */
static kmp_polynomial deflection(const kmp_beam_shape *shape, const double s[2])
{
    const kmp_beam_field *field = shape->family == KMP_BEAM_TORSION ? &shape->turn[0]
                                  : shape->family == KMP_BEAM_AXIAL ? &shape->way[0]
                                                                    : &shape->way[1 + (int)shape->family];
    kmp_polynomial sum = field->part[0];
    kmp_polynomial_add(&sum, s[0], &field->part[1]);
    kmp_polynomial_add(&sum, s[1], &field->part[2]);
    return sum;
}

static bool take_modes(const kmp_beam *beam, const double s[2], kmp_beam_family family, kmp_beam_shape *shapes)
{
    double k[KMP_BEAM_MOST * KMP_BEAM_MOST], m[KMP_BEAM_MOST * KMP_BEAM_MOST], x[KMP_BEAM_MOST * KMP_BEAM_MOST];
    double values[KMP_BEAM_MOST];
    const int n = beam->count[family];
    kmp_polynomial made[KMP_BEAM_MOST] = {{0}};
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            k[i + n * j] = stiffness_between(beam, s, &shapes[i], &shapes[j]);
            m[i + n * j] = mass_between(beam, s, &shapes[i], &shapes[j]);
        }
    if (!kmp_beam_modes(n, k, m, x, values))
        return false;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            kmp_polynomial_add(&made[i], x[j + n * i], &shapes[j].own);
    for (int i = 0; i < n; i++)
        shapes[i] = shape_of(beam, family, &made[i]);
    return true;
}

static void scale(const kmp_beam *beam, const double s[2], kmp_beam_shape *shape)
{
    const kmp_polynomial field = deflection(shape, s);
    kmp_polynomial own = {0};
    kmp_polynomial_add(&own, 1 / peak_of(&field), &shape->own);
    *shape = shape_of(beam, shape->family, &own);
}

/* Subtracts the rigid motions that have the momentum and angular momentum of a shape: it has no mass with either. */
static void leave_rigid(const kmp_beam *beam, const double s[2], kmp_beam_shape *shape)
{
    const kmp_beam_family family = shape->family;
    for (int degree = 0; degree < first_degree(family); degree++) {
        const kmp_polynomial power = kmp_taper_term(degree), still = kmp_taper_term(0);
        kmp_beam_shape rigid = shape_of(beam, family, &power), shift = shape_of(beam, family, &still);
        kmp_polynomial turn = power, own = shape->own;
        if (degree > 0) { /* about the centre of mass, so that it has no momentum itself */
            kmp_polynomial_add(&turn, -mass_between(beam, s, &rigid, &shift) / mass_between(beam, s, &shift, &shift),
                               &still);
            rigid = shape_of(beam, family, &turn);
        }
        kmp_polynomial_add(&own, -mass_between(beam, s, shape, &rigid) / mass_between(beam, s, &rigid, &rigid), &turn);
        *shape = shape_of(beam, family, &own);
    }
}

static kmp_polynomial first_polynomial(const kmp_beam *beam, kmp_beam_family family, int k)
{
    const kmp_polynomial base = frame_factor(beam, family), term = kmp_taper_term(k);
    if (beam->raw)
        return monomial(beam, family, k);
    return beam->frame == KMP_FRAME_MEAN ? kmp_taper_term(k + first_degree(family))
                                         : kmp_polynomial_product(&base, &term);
}

bool kmp_beam_shapes(const kmp_beam *beam, const double s[2], kmp_beam_shape *shapes)
{
    bool good = true;
    for (int f = 0; f < KMP_BEAM_FAMILIES; f++) {
        const kmp_beam_family family = (kmp_beam_family)f;
        for (int k = 0; k < beam->count[f]; k++) {
            const kmp_polynomial own = first_polynomial(beam, family, k);
            shapes[k] = shape_of(beam, family, &own);
            if (beam->frame == KMP_FRAME_MEAN)
                leave_rigid(beam, s, &shapes[k]);
        }
        if (!beam->raw) {
            good = good && take_modes(beam, s, family, shapes) && take_modes(beam, s, family, shapes);
            for (int k = 0; k < beam->count[f]; k++)
                scale(beam, s, &shapes[k]);
        }
        shapes += beam->count[f];
    }
    return good;
}

/* -- second order ------------------------------------------------------------------------------------ */

static kmp_beam_field start_of(const kmp_beam_field *field)
{
    kmp_beam_field start = {0};
    for (int i = 0; i < KMP_BEAM_PARTS; i++) {
        double value = kmp_polynomial_at(&field->part[i], 0);
        start.part[i] = (kmp_polynomial){.count = value != 0, .c = {value}};
    }
    return start;
}

/* field += factor * entry i, j of a~ b~, which is b_i a_j - a.b in the diagonal. */
static void add_cross_product(kmp_beam_field *field, double factor, const kmp_beam_field *a, const kmp_beam_field *b,
                              int i, int j)
{
    if (i != j)
        field_add_product(field, factor, &a[j], &b[i]);
    for (int c = 0; c < 3; c++)
        if (i == j && c != i)
            field_add_product(field, -factor, &a[c], &b[c]);
}

/* Adds half of what is of shape a before shape b. */
static void add_ordered(const kmp_beam_shape *a, const kmp_beam_shape *b, kmp_beam_second *second)
{
    kmp_beam_field start[2][3], slope[3];
    for (int c = 0; c < 3; c++) {
        start[0][c] = start_of(&a->turn[c]);
        start[1][c] = start_of(&b->turn[c]);
        slope[c] = b->turn[c];
        field_differentiate(&slope[c]);
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            kmp_beam_field entry = {0};
            add_cross_product(&entry, 0.5, a->turn, slope, i, j);
            field_integrate(&entry);
            add_cross_product(&entry, 0.25, start[0], start[1], i, j);
            if (j > 0) {
                field_add(&second->section[i][j - 1], 1, &entry);
                continue;
            }
            const int k = (i + 1) % 3, l = (i + 2) % 3;
            field_add_product(&entry, 0.5, &a->turn[k], &b->strain[l]);
            field_add_product(&entry, -0.5, &a->turn[l], &b->strain[k]);
            field_integrate(&entry);
            field_add(&second->way[i], 1, &entry);
        }
}

void kmp_beam_second_order(const kmp_beam_shape *a, const kmp_beam_shape *b, kmp_beam_second *second)
{
    memset(second, 0, sizeof *second);
    add_ordered(a, b, second);
    add_ordered(b, a, second);
}

static void add_angles(const kmp_beam_shape *a, const kmp_beam_shape *b, kmp_beam_field angle[3])
{
    static const double sign[3] = {0.5, -0.5, 0.5};
    for (int i = 0; i < 3; i++) {
        const int k = (i + 1) % 3, l = (i + 2) % 3, low = k < l ? k : l, high = k < l ? l : k;
        kmp_beam_field slope[2] = {b->turn[l], b->turn[k]}, sum = {0};
        field_differentiate(&slope[0]);
        field_differentiate(&slope[1]);
        field_add_product(&sum, 0.5, &a->turn[k], &slope[0]);
        field_add_product(&sum, -0.5, &a->turn[l], &slope[1]);
        field_integrate(&sum);
        field_add_product(&sum, sign[i], &a->turn[low], &b->turn[high]);
        field_add(&angle[i], 1, &sum);
    }
}

void kmp_beam_second_angles(const kmp_beam_shape *a, const kmp_beam_shape *b, kmp_beam_field angle[3])
{
    memset(angle, 0, 3 * sizeof *angle);
    add_angles(a, b, angle);
    add_angles(b, a, angle);
}

/* -- a basis of second order ------------------------------------------------------------------------- */

/* By Gram and Schmidt, the largest remainder first (Golub and Van Loan 2013, section 5.4.2): most displacements are
 * sums of few functions of the basis, and the first one is its multiple. */

/* Remainders within this part of the largest displacement are rounding. */
#define REMAINDER 1e-13

static double size_of(const kmp_polynomial *p)
{
    return sqrt(kmp_polynomial_mean(p, p));
}

/* Takes a multiple of a function off from a polynomial; returns it. */
static double take_off(kmp_polynomial *from, const kmp_polynomial *function, double square, double least)
{
    const double part = kmp_polynomial_mean(from, function) / square;
    if (fabs(part) * sqrt(square) <= least)
        return 0;
    kmp_polynomial_add(from, -part, function);
    return part;
}

bool kmp_beam_basis_of(kmp_arena *arena, int pairs, const kmp_beam_second *second, int c, kmp_beam_basis *basis)
{
    const int count = pairs * KMP_BEAM_PARTS;
    kmp_polynomial *rest = KMP_ARENA_NEW(arena, kmp_polynomial, count);
    double size = 0, found = 0;
    basis->count = 0;
    basis->part = KMP_ARENA_NEW(arena, kmp_beam_amount, KMP_POLYNOMIAL_ROOM * pairs);
    if (!rest || !basis->part)
        return false;
    for (int i = 0; i < count; i++) {
        rest[i] = second[i / KMP_BEAM_PARTS].way[c].part[i % KMP_BEAM_PARTS];
        size = fmax(size, size_of(&rest[i]));
    }
    for (; size > 0 && basis->count < KMP_POLYNOMIAL_ROOM; basis->count++) {
        int largest = 0;
        found = 0;
        for (int i = 0; i < count; i++)
            if (size_of(&rest[i]) > found * (1 + REMAINDER)) {
                largest = i;
                found = size_of(&rest[i]);
            }
        if (found <= REMAINDER * size)
            break;
        kmp_polynomial *function = &basis->function[basis->count];
        *function = rest[largest]; /* without what it has of the functions before it */
        for (int k = 0; k < basis->count; k++)
            (void)take_off(function, &basis->function[k], kmp_polynomial_mean(&basis->function[k], &basis->function[k]),
                           0);
        const double square = kmp_polynomial_mean(function, function);
        kmp_beam_amount *own = basis->part + (ptrdiff_t)basis->count * pairs;
        for (int i = 0; i < count; i++)
            own[i / KMP_BEAM_PARTS].part[i % KMP_BEAM_PARTS] =
                i == largest ? 1 : take_off(&rest[i], function, square, REMAINDER * size / 100);
        rest[largest].count = 0;
    }
    return true;
}
