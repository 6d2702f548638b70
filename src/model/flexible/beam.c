/* SPDX-License-Identifier: BSD-3-Clause */
/* Integrals over xi are doubles; what they are multiplied by, powers of the length among them, are numbers of the
 * model. A displacement of a coordinate in metres is dimensionless: it has one power of the length less than the
 * stiffness of an angle.
 *
 * Quadratic functions of the coordinates. Full: the axis' displacement r2 along x, y and z in a basis of orthogonal
 * polynomials each. First: without products of second order only the moments of r2 count, each of which is one
 * function. In both, the turn R2 of the sections counts only by its second moments. */
#include "model/flexible/beam.h"
#include "model/flexible/beam_fields.h"
#include "model/language/expression_value.h"
#include "model/language/number_algebra.h"
#include <math.h>
#include <string.h>

/* A pair of shapes, and the numbers of a power of the length. */
enum { LEAST_POWER = -5, MOST_POWER = 4, POWERS = MOST_POWER - LEAST_POWER + 1 };

typedef struct maker {
    const kmp_taper *line_mass, *section_mass; /* of the part, by the length of the whole beam */
    kmp_polynomial place;                      /* xi over the part */
    kmp_arena *arena;
    kmp_arena scratch;
    const kmp_beam *beam;
    kmp_flexible *to;
    kmp_beam_shape *shapes;
    kmp_beam_second *second;  /* of shapes k <= l, by l (l + 1)/2 + k */
    kmp_beam_basis *basis;    /* of the displacements of second order along x, y, z */
    kmp_beam_amount *amounts; /* room for as many */
    kmp_number power[POWERS];
    kmp_number part[KMP_BEAM_PARTS];
    int used;   /* quadratic functions that are made */
    bool whole; /* not a part */
} maker;

static const kmp_polynomial one = {.count = 1, .c = {1}};

static kmp_number power(const maker *m, int exponent)
{
    return m->power[exponent - LEAST_POWER];
}

/* 1 for a coordinate in metres. */
static int metres(const maker *m, int k)
{
    return m->shapes[k].family != KMP_BEAM_TORSION;
}

static kmp_number scaled(const maker *m, kmp_number a, int exponent)
{
    return kmp_number_times(m->arena, a, power(m, exponent));
}

/* scale times an amount */
static kmp_number number_of(const maker *m, kmp_number scale, const kmp_beam_amount *amount)
{
    kmp_number sum = {.value = 0};
    for (int i = 0; i < KMP_BEAM_PARTS; i++)
        sum = kmp_number_add(m->arena, sum, kmp_number_scale(m->arena, amount->part[i], m->part[i]));
    return kmp_number_times(m->arena, scale, sum);
}

/* The integral of a b times a number of the sections, times a power of the length. */
static kmp_number product_of(const maker *m, const kmp_taper *by, int exponent, const kmp_beam_field *a,
                             const kmp_beam_field *b)
{
    kmp_number sum = {.value = 0};
    for (int k = 0; k < kmp_taper_shares(by); k++) {
        const kmp_taper_share share = kmp_taper_share_of(by, k);
        const kmp_beam_amount amount = kmp_beam_field_mean(a, b, &share);
        sum = kmp_number_add(m->arena, sum, number_of(m, scaled(m, share.c, exponent), &amount));
    }
    return sum;
}

/* The integral of a field times a polynomial and a number of the sections, times a power of the length. */
static kmp_number moment_of(const maker *m, const kmp_taper *by, int exponent, const kmp_beam_field *a,
                            const kmp_polynomial *b)
{
    kmp_number sum = {.value = 0};
    for (int k = 0; k < kmp_taper_shares(by); k++) {
        const kmp_taper_share share = kmp_taper_share_of(by, k);
        const kmp_beam_amount amount = kmp_beam_field_mean_with(a, b, &share);
        sum = kmp_number_add(m->arena, sum, number_of(m, scaled(m, share.c, exponent), &amount));
    }
    return sum;
}

/* The integral of two polynomials and a number of the sections, times a power of the length. */
static kmp_number plain_moment(const maker *m, const kmp_taper *by, int exponent, const kmp_polynomial *a,
                               const kmp_polynomial *b)
{
    kmp_number sum = {.value = 0};
    for (int k = 0; k < kmp_taper_shares(by); k++) {
        const kmp_taper_share share = kmp_taper_share_of(by, k);
        const double mean = kmp_taper_share_mean(&share, a, b);
        sum = kmp_number_add(m->arena, sum, kmp_number_scale(m->arena, mean, scaled(m, share.c, exponent)));
    }
    return sum;
}

static void add(const maker *m, kmp_number *to, kmp_number number)
{
    *to = kmp_number_add(m->arena, *to, number);
}

static const kmp_beam_second *second_of(const maker *m, int k, int l)
{
    return &m->second[k < l ? l * (l + 1) / 2 + k : k * (k + 1) / 2 + l];
}

/* -- first order ------------------------------------------------------------------------------------- */

/* Of a section's point at y, or z (c: 1, 2), the component a of theta x (0, y, z) by y: the component of theta, and its
 * sign, 0 where there is none. */
static int section_part(int c, int a, int *component)
{
    *component = 3 - a - c;
    return a == c ? 0 : (a + 1) % 3 == c ? -1 : 1;
}

/* In mean axes a shape has no momentum and no angular momentum: numbers that do not follow parameters are exact.
 */
static void clear_rigid(const maker *m, int k)
{
    static const int own[KMP_BEAM_FAMILIES] = {3, 6, 7, -1}, other[KMP_BEAM_FAMILIES] = {1, 2, 5, -1};
    const kmp_beam_family family = m->shapes[k].family;
    kmp_number *z = m->to->by_place + (ptrdiff_t)9 * k;
    for (int a = 0; a < 3; a++)
        if (!m->to->field[3 * k + a].expr)
            m->to->field[3 * k + a] = (kmp_number){.value = 0};
    if (own[family] >= 0 && !z[own[family]].expr && !z[other[family]].expr)
        z[own[family]] = z[other[family]];
}

static void put_place(const maker *m, int k)
{
    const kmp_beam_shape *shape = &m->shapes[k];
    const int less = metres(m, k);
    kmp_number *z = m->to->by_place + (ptrdiff_t)9 * k;
    for (int a = 0; a < 3; a++) {
        m->to->field[3 * k + a] = moment_of(m, m->line_mass, 2 - less, &shape->way[a], &one);
        z[3 * a] = moment_of(m, m->line_mass, 3 - less, &shape->way[a], &m->place);
        for (int c = 1, i; c < 3; c++) {
            const int sign = section_part(c, a, &i);
            if (sign == 0)
                continue;
            const kmp_number section = moment_of(m, &m->section_mass[c - 1], 1 - less, &shape->turn[i], &one);
            z[3 * a + c] = kmp_number_scale(m->arena, sign, section);
        }
    }
}

/* Entries (a, b) of the integral of phi_k phi_l' dm. */
static void put_product(const maker *m, int k, int l)
{
    const kmp_beam_shape *first = &m->shapes[k], *other = &m->shapes[l];
    const int n = m->to->count + m->to->quadratic_count, less = metres(m, k) + metres(m, l);
    kmp_number *t = m->to->by_field + 9 * ((ptrdiff_t)n * k + l);
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            t[3 * a + b] = product_of(m, m->line_mass, 3 - less, &first->way[a], &other->way[b]);
            for (int c = 1, i, j; c < 3; c++) {
                const int sign = section_part(c, a, &i) * section_part(c, b, &j);
                if (sign == 0)
                    continue;
                const kmp_number section =
                    product_of(m, &m->section_mass[c - 1], 1 - less, &first->turn[i], &other->turn[j]);
                add(m, &t[3 * a + b], kmp_number_scale(m->arena, sign, section));
            }
        }
}

/* The stiffness between two shapes of a family. */
static void put_stiffness(const maker *m, int k, int l)
{
    const kmp_beam_family family = m->shapes[k].family;
    kmp_polynomial u = kmp_polynomial_derivative(&m->shapes[k].own), w = kmp_polynomial_derivative(&m->shapes[l].own);
    const kmp_taper *by = &m->beam->stiffness[family];
    const bool bends = family == KMP_BEAM_Y || family == KMP_BEAM_Z;
    kmp_number *sum = &m->to->stiffness[m->to->count * k + l];
    if (bends) {
        u = kmp_polynomial_derivative(&u);
        w = kmp_polynomial_derivative(&w);
    }
    const kmp_polynomial u_slope = kmp_polynomial_derivative(&u), w_slope = kmp_polynomial_derivative(&w);
    for (int j = 0; j < kmp_taper_shares(by); j++) {
        const kmp_taper_share share = kmp_taper_share_of(by, j);
        kmp_beam_amount amount = {{kmp_taper_share_mean(&share, &u, &w)}};
        if (bends && m->beam->sheared)
            amount.part[1 + (int)family] = kmp_polynomial_mean(&u_slope, &w_slope);
        add(m, sum, number_of(m, scaled(m, share.c, bends ? -3 : -1), &amount));
    }
}

/* Modes have no mass or stiffness between them. Numbers that follow parameters may have it for other values of these.
 */
static void clear_between_modes(const maker *m, int k, int l)
{
    const int n = m->to->count + m->to->quadratic_count, own = (int)m->shapes[k].family;
    const int along = own == KMP_BEAM_AXIAL ? 0 : 1 + own; /* of the axis' displacement */
    kmp_number *t = m->to->by_field + 9 * ((ptrdiff_t)n * k + l), *stiffness = &m->to->stiffness[m->to->count * k + l];
    const bool fixed = !t[0].expr && !t[4].expr && !t[8].expr;
    const bool straight = own == KMP_BEAM_TORSION || own == KMP_BEAM_AXIAL;
    const bool alone = straight || (!m->beam->sheared && kmp_taper_is_nothing(&m->beam->section_mass[own]));
    if (alone && (!m->beam->reshaped || fixed))
        for (int a = 0; a < 3; a++)
            t[4 * a] = (kmp_number){.value = 0};
    else if (fixed)
        t[4 * along] = (kmp_number){.value = 0 - (t[4 * ((along + 1) % 3)].value + t[4 * ((along + 2) % 3)].value)};
    if ((!m->beam->reshaped && (straight || !m->beam->sheared)) || !stiffness->expr)
        *stiffness = (kmp_number){.value = 0};
}

static void put_first_order(const maker *m)
{
    kmp_flexible *to = m->to;
    const int n = to->count, all = n + to->quadratic_count;
    for (int k = 0; k < n; k++) {
        put_place(m, k);
        if (m->whole && m->beam->frame == KMP_FRAME_MEAN)
            clear_rigid(m, k);
    }
    for (int k = 0; k < n; k++)
        for (int l = k; l < n; l++) {
            const bool related = m->shapes[k].family == m->shapes[l].family;
            put_product(m, k, l);
            if (m->whole && related)
                put_stiffness(m, k, l);
            if (m->whole && related && k < l && !m->beam->raw)
                clear_between_modes(m, k, l);
            to->stiffness[n * l + k] = to->stiffness[n * k + l];
            for (int a = 0; a < 9 && k < l; a++)
                to->by_field[9 * ((ptrdiff_t)all * l + k) + a] =
                    to->by_field[9 * ((ptrdiff_t)all * k + l) + 3 * (a % 3) + a / 3];
        }
}

/* -- quadratic functions ----------------------------------------------------------------------------- */

/* The next function: length^exponent times q' A q, where A is the sum of the terms of a factor times their amounts, in
 * the order of `second`. Its number among all fields; -1: it is zero. While functions are counted there is no room for
 * it. */
static int put_quadratic(maker *m, const kmp_beam_amount *amounts, const kmp_taper *factor, int exponent)
{
    const int n = m->to->count, pairs = n * (n + 1) / 2;
    double largest = 0;
    const int shares = kmp_taper_shares(factor);
    for (int i = 0; i < pairs * shares; i++)
        for (int p = 0; p < KMP_BEAM_PARTS; p++)
            largest = fmax(largest, fabs(amounts[i].part[p]));
    if (kmp_taper_is_nothing(factor) || largest == 0)
        return -1;
    const int own = m->used++;
    if (!m->to->numbers)
        return -1;
    kmp_number *e = m->to->quadratic + (ptrdiff_t)own * n * n;
    for (int l = 0, i = 0; l < n; l++)
        for (int k = 0; k <= l; k++, i++) {
            const int less = metres(m, k) + metres(m, l);
            kmp_number number = {.value = 0};
            for (int j = 0; j < shares; j++)
                add(m, &number,
                    number_of(m, scaled(m, kmp_taper_share_of(factor, j).c, exponent - less), &amounts[j * pairs + i]));
            e[n * k + l] = e[n * l + k] = kmp_number_scale(m->arena, 2, number);
        }
    return n + own;
}

/* Products of two functions of the basis along c and a, which are numbers `own` and `other` of all fields. */
static void put_axis_product(const maker *m, int own, int other, int c, int a, const kmp_polynomial *u,
                             const kmp_polynomial *w)
{
    const kmp_number product = plain_moment(m, m->line_mass, 1, u, w);
    const ptrdiff_t all = m->to->count + m->to->quadratic_count;
    m->to->by_field[9 * (all * own + other) + 3 * c + a] = product;
    m->to->by_field[9 * (all * other + own) + 3 * a + c] = product;
}

/* Integrals of a function of the basis along axis c, which is number `own` of all fields. */
static void put_axis_field(const maker *m, int own, int c, const kmp_polynomial *function)
{
    const int n = m->to->count, all = n + m->to->quadratic_count;
    m->to->field[3 * own + c] = plain_moment(m, m->line_mass, 1, function, &one);
    m->to->by_place[9 * own + 3 * c] = plain_moment(m, m->line_mass, 2, function, &m->place);
    for (int k = 0; k < n; k++)
        for (int b = 0; b < 3; b++) {
            const kmp_number number = moment_of(m, m->line_mass, 2 - metres(m, k), &m->shapes[k].way[b], function);
            m->to->by_field[9 * ((ptrdiff_t)all * own + k) + 3 * c + b] = number;
            m->to->by_field[9 * ((ptrdiff_t)all * k + own) + 3 * b + c] = number;
        }
}

static void put_whole_axis(maker *m)
{
    const int pairs = m->to->count * (m->to->count + 1) / 2;
    const kmp_taper unit = kmp_taper_constant((kmp_number){.value = 1});
    int first[3];
    for (int c = 0; c < 3; c++) {
        const kmp_beam_basis *basis = &m->basis[c];
        first[c] = m->to->count + m->used;
        for (int j = 0; j < basis->count; j++) {
            const int own = put_quadratic(m, basis->part + (ptrdiff_t)j * pairs, &unit, 1);
            if (own < 0)
                continue;
            put_axis_field(m, own, c, &basis->function[j]);
            for (int a = 0; a <= c; a++)
                for (int k = 0; k < (a < c ? m->basis[a].count : j + 1); k++)
                    if (a < c || k == j || kmp_taper_varies(m->line_mass))
                        put_axis_product(m, own, first[a] + k, c, a, &basis->function[j], &m->basis[a].function[k]);
        }
    }
}

/* One function for each component of the axis' first moment and of its moment by x. */
static void put_moments_of_axis(maker *m, kmp_beam_amount *amounts)
{
    const int pairs = m->to->count * (m->to->count + 1) / 2;
    for (int by_x = 0; by_x < 2; by_x++)
        for (int c = 0; c < 3; c++) {
            for (int i = 0; i < pairs * kmp_taper_shares(m->line_mass); i++) {
                const kmp_taper_share share = kmp_taper_share_of(m->line_mass, i / pairs);
                amounts[i] = kmp_beam_field_mean_with(&m->second[i % pairs].way[c], by_x ? &m->place : &one, &share);
            }
            const int own = put_quadratic(m, amounts, m->line_mass, 2 + by_x);
            if (own >= 0 && by_x)
                m->to->by_place[9 * own + 3 * c] = (kmp_number){.value = 1};
            else if (own >= 0)
                m->to->field[3 * own + c] = (kmp_number){.value = 1};
        }
}

static void put_moments_of_sections(maker *m, kmp_beam_amount *amounts)
{
    const int pairs = m->to->count * (m->to->count + 1) / 2;
    for (int a = 0; a < 3; a++)
        for (int c = 1; c < 3; c++) {
            for (int i = 0; i < pairs * kmp_taper_shares(&m->section_mass[c - 1]); i++) {
                const kmp_taper_share share = kmp_taper_share_of(&m->section_mass[c - 1], i / pairs);
                amounts[i] = kmp_beam_field_mean_with(&m->second[i % pairs].section[a][c - 1], &one, &share);
            }
            const int own = put_quadratic(m, amounts, &m->section_mass[c - 1], 1);
            if (own >= 0)
                m->to->by_place[9 * own + 3 * a + c] = (kmp_number){.value = 1};
        }
}

static void put_second_order(maker *m, kmp_beam_amount *amounts)
{
    m->used = 0;
    if (m->beam->stiffening == KMP_STIFFENING_FULL)
        put_whole_axis(m);
    if (m->beam->stiffening == KMP_STIFFENING_FIRST)
        put_moments_of_axis(m, amounts);
    if (m->beam->stiffening != KMP_STIFFENING_NONE)
        put_moments_of_sections(m, amounts);
}

/* -- stations ---------------------------------------------------------------------------------------- */

/* The value of a field at a place, times a power of the length. */
static kmp_number value_of(const maker *m, const kmp_beam_field *field, kmp_number xi, int exponent)
{
    kmp_number sum = {.value = 0};
    for (int p = 0; p < KMP_BEAM_PARTS; p++)
        if (field->part[p].count > 0)
            add(m, &sum, kmp_number_times(m->arena, m->part[p], kmp_polynomial_number(m->arena, &field->part[p], xi)));
    return scaled(m, sum, exponent);
}

static void put_station(const maker *m, kmp_station *station, kmp_number x)
{
    const int n = m->to->count;
    const kmp_number xi =
        kmp_number_same(x, m->beam->length) ? (kmp_number){.value = 1} : kmp_number_over(m->arena, x, m->beam->length);
    station->at[0] = x;
    for (int c = 0; c < 3; c++)
        station->section[c] = kmp_taper_at(m->arena, &m->beam->section[c], xi);
    /* Moments of a section by the curvature and twist of the axis: G J phi', -E Iy w'', E Iz v''. */
    static const int axis[] = {[KMP_BEAM_Y] = 2, [KMP_BEAM_Z] = 1, [KMP_BEAM_TORSION] = 0};
    for (int k = 0; k < n; k++) {
        const kmp_beam_family family = m->shapes[k].family;
        if (family == KMP_BEAM_AXIAL)
            continue;
        kmp_polynomial curve = kmp_polynomial_derivative(&m->shapes[k].own);
        if (family != KMP_BEAM_TORSION)
            curve = kmp_polynomial_derivative(&curve);
        const kmp_number here = kmp_taper_at(m->arena, &m->beam->stiffness[family], xi);
        const kmp_number stiffness = scaled(m, here, family == KMP_BEAM_TORSION ? -1 : -2);
        const kmp_number moment = kmp_number_times(m->arena, stiffness, kmp_polynomial_number(m->arena, &curve, xi));
        station->strained[n * axis[family] + k] = kmp_number_scale(m->arena, family == KMP_BEAM_Z ? -1 : 1, moment);
    }
    if (kmp_number_is_nothing(x) && m->beam->frame == KMP_FRAME_CLAMPED)
        return;
    for (int k = 0; k < n; k++)
        for (int c = 0; c < 3; c++) {
            station->shift[n * c + k] = value_of(m, &m->shapes[k].way[c], xi, 1 - metres(m, k));
            station->turn[n * c + k] = value_of(m, &m->shapes[k].turn[c], xi, -metres(m, k));
        }
    for (int l = 0; l < n && m->beam->stiffening != KMP_STIFFENING_NONE; l++)
        for (int k = 0; k <= l; k++) {
            const int less = metres(m, k) + metres(m, l);
            kmp_beam_field angle[3];
            kmp_beam_second_angles(&m->shapes[k], &m->shapes[l], angle);
            for (int c = 0; c < 3; c++) {
                const kmp_number way = value_of(m, &second_of(m, k, l)->way[c], xi, 1 - less);
                const ptrdiff_t at = ((ptrdiff_t)c * n + k) * n + l, across = ((ptrdiff_t)c * n + l) * n + k;
                station->shift_more[at] = station->shift_more[across] = kmp_number_scale(m->arena, 2, way);
                station->turn_more[at] = station->turn_more[across] = value_of(m, &angle[c], xi, -less);
            }
        }
}

/* -- damping ----------------------------------------------------------------------------------------- */

static kmp_number mass_of(const maker *m, int k, int l)
{
    const kmp_number *t = m->to->by_field + 9 * ((ptrdiff_t)(m->to->count + m->to->quadratic_count) * k + l);
    return kmp_number_add(m->arena, kmp_number_add(m->arena, t[0], t[4]), t[8]);
}

/* 2 ratio times M V diag(w) V' M of the modes of a family, whose shapes begin with `first`, by nominal values. */
static void damp_modes(const maker *m, int first, int count)
{
    double k[KMP_BEAM_MOST * KMP_BEAM_MOST], mass[KMP_BEAM_MOST * KMP_BEAM_MOST], x[KMP_BEAM_MOST * KMP_BEAM_MOST];
    double load[KMP_BEAM_MOST * KMP_BEAM_MOST] = {0}, values[KMP_BEAM_MOST];
    const int n = m->to->count;
    for (int i = 0; i < count * count; i++) {
        const int row = i % count, column = i / count;
        k[i] = m->to->stiffness[n * (first + row) + first + column].value;
        mass[i] = mass_of(m, first + row, first + column).value;
    }
    if (!kmp_beam_modes(count, k, mass, x, values))
        return;
    for (int i = 0; i < count * count; i++)
        for (int j = 0; j < count; j++)
            load[i] += mass_of(m, first + i % count, first + j).value * x[j + count * (i / count)];
    for (int i = 0; i < count; i++)
        for (int j = 0; j < count; j++) {
            double sum = 0;
            for (int e = 0; e < count; e++)
                sum += load[i + count * e] * load[j + count * e] / (values[e] * sqrt(values[e]));
            m->to->damping[n * (first + i) + first + j] = kmp_number_scale(m->arena, 2 * sum, m->beam->ratio);
        }
}

static void put_damping(const maker *m)
{
    const int n = m->to->count;
    for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++) {
            kmp_number *d = &m->to->damping[n * k + l];
            add(m, d, kmp_number_times(m->arena, m->beam->rayleigh[0], mass_of(m, k, l)));
            add(m, d, kmp_number_times(m->arena, m->beam->rayleigh[1], m->to->stiffness[n * k + l]));
        }
    if (kmp_number_is_nothing(m->beam->ratio))
        return;
    for (int k = 0; k < n && !m->beam->raw; k++) {
        const kmp_number product = kmp_number_times(m->arena, m->to->stiffness[n * k + k], mass_of(m, k, k));
        const kmp_number twice = kmp_number_scale(m->arena, 2, m->beam->ratio);
        m->to->damping[n * k + k] = kmp_number_times(m->arena, twice, kmp_number_root(m->arena, product));
    }
    for (int f = 0, first = 0; f < KMP_BEAM_FAMILIES && m->beam->raw; first += m->beam->count[f++])
        if (m->beam->count[f] > 0)
            damp_modes(m, first, m->beam->count[f]);
}

/* -- the whole --------------------------------------------------------------------------------------- */

static void make_factors(maker *m)
{
    const kmp_beam *b = m->beam;
    m->power[-LEAST_POWER] = m->part[0] = (kmp_number){.value = 1};
    for (int e = 1; e <= MOST_POWER; e++)
        m->power[e - LEAST_POWER] = kmp_number_times(m->arena, power(m, e - 1), b->length);
    for (int e = 1; e <= -LEAST_POWER; e++) {
        const kmp_number up = e <= MOST_POWER ? power(m, e) : kmp_number_times(m->arena, power(m, e - 1), b->length);
        m->power[-e - LEAST_POWER] = kmp_number_over(m->arena, m->part[0], up);
    }
    for (int plane = 0; plane < 2 && b->sheared; plane++)
        if (b->count[plane] > 0)
            m->part[1 + plane] = scaled(m, kmp_number_over(m->arena, b->stiffness[plane].c[0], b->shear[plane]), -2);
    m->part[3] = kmp_number_times(m->arena, m->part[1], m->part[1]);
    m->part[4] = kmp_number_times(m->arena, m->part[1], m->part[2]);
    m->part[5] = kmp_number_times(m->arena, m->part[2], m->part[2]);
}

/* The shapes of both orders. */
static bool make_shapes(maker *m)
{
    const int n = m->to->count, pairs = n * (n + 1) / 2;
    int terms = 1; /* of the masses */
    for (int c = 0; c < 3; c++)
        terms += kmp_taper_shares(c == 0 ? &m->beam->line_mass : &m->beam->section_mass[c - 1]);
    m->whole = true;
    m->line_mass = &m->beam->line_mass;
    m->section_mass = m->beam->section_mass;
    m->place = (kmp_polynomial){.count = 2, .c = {0.5, 0.5}};
    make_factors(m);
    if (!KMP_ARENA_MAKE(
            &m->scratch, KMP_ROOM(kmp_beam_shape, n, &m->shapes), KMP_ROOM(kmp_beam_second, pairs, &m->second),
            KMP_ROOM(kmp_beam_amount, pairs * terms, &m->amounts), KMP_ROOM(kmp_beam_basis, 3, &m->basis)) ||
        !kmp_beam_shapes(m->beam, (const double[]){m->part[1].value, m->part[2].value}, m->shapes))
        return false;
    for (int l = 0, i = 0; l < n && m->beam->stiffening != KMP_STIFFENING_NONE; l++)
        for (int k = 0; k <= l; k++, i++)
            kmp_beam_second_order(&m->shapes[k], &m->shapes[l], &m->second[i]);
    return true;
}

/* The moments of a body, or of a part of it. */
static bool put_moments(maker *m)
{
    kmp_flexible *to = m->to;
    for (int c = 0; c < 3 && m->beam->stiffening == KMP_STIFFENING_FULL; c++)
        if (!kmp_beam_basis_of(&m->scratch, to->count * (to->count + 1) / 2, m->second, c, &m->basis[c]))
            return false;
    put_second_order(m, m->amounts);
    to->quadratic_count = m->used;
    kmp_flexible_lay(to, NULL);
    kmp_number *numbers = KMP_ARENA_NEW(m->arena, kmp_number, to->number_count);
    if (!numbers)
        return false;
    kmp_flexible_lay(to, numbers);
    *to->length = m->beam->length;
    *to->mass = plain_moment(m, m->line_mass, 1, &one, &one);
    to->moment[0] = plain_moment(m, m->line_mass, 2, &one, &m->place);
    to->second[0] = plain_moment(m, m->line_mass, 3, &m->place, &m->place);
    to->second[1] = plain_moment(m, &m->section_mass[0], 1, &one, &one);
    to->second[2] = plain_moment(m, &m->section_mass[1], 1, &one, &one);
    put_first_order(m);
    put_second_order(m, m->amounts);
    return true;
}

/* The part beyond xi = from, by fields over 0 .. 1 and masses by length that are as much less as it is shorter. */
static kmp_flexible *part_beyond(const maker *m, double from)
{
    const int n = m->to->count, pairs = n * (n + 1) / 2;
    kmp_flexible *part = KMP_ARENA_NEW(m->arena, kmp_flexible, 1);
    maker own = *m;
    own.scratch = (kmp_arena){0};
    own.to = part;
    own.whole = false;
    kmp_taper masses[3];
    for (int c = 0; c < 3; c++) {
        masses[c] = kmp_taper_part(m->arena, c == 0 ? m->line_mass : &m->section_mass[c - 1], from, 1);
        masses[c] = kmp_taper_scale(m->arena, (kmp_number){.value = 1 - from}, &masses[c]);
    }
    own.line_mass = masses;
    own.section_mass = masses + 1;
    own.place = kmp_polynomial_part(&m->place, from, 1);
    bool made =
        part && KMP_ARENA_MAKE(&own.scratch, KMP_ROOM(kmp_beam_shape, n, &own.shapes),
                               KMP_ROOM(kmp_beam_second, pairs, &own.second), KMP_ROOM(kmp_beam_basis, 3, &own.basis));
    if (made) {
        *part = (kmp_flexible){.body = m->to->body, .first = m->to->first, .count = n};
        for (int k = 0; k < n; k++) {
            own.shapes[k] = m->shapes[k];
            for (int c = 0; c < 3; c++) {
                kmp_beam_field_cut(&own.shapes[k].way[c], from);
                kmp_beam_field_cut(&own.shapes[k].turn[c], from);
            }
        }
        for (int i = 0; i < pairs; i++) {
            own.second[i] = m->second[i];
            for (int c = 0; c < 3; c++) {
                kmp_beam_field_cut(&own.second[i].way[c], from);
                for (int b = 0; b < 2; b++)
                    kmp_beam_field_cut(&own.second[i].section[c][b], from);
            }
        }
        made = put_moments(&own);
    }
    m->arena->failed = m->arena->failed || own.scratch.failed;
    kmp_arena_free(&own.scratch);
    return made ? part : NULL;
}

static bool make_all(maker *m)
{
    kmp_flexible *to = m->to;
    if (!make_shapes(m) || !put_moments(m))
        return false;
    put_damping(m);
    for (int k = 0; k < to->station_count; k++) {
        const double from = m->beam->stations[k].value / m->beam->length.value;
        put_station(m, &to->stations[k], m->beam->stations[k]);
        if (k > 0 && m->beam->fixed[k] && !(to->stations[k].beyond = part_beyond(m, fmin(from, 1))))
            return false;
    }
    to->moved = kmp_flexible_joint_moves(to);
    return !m->arena->failed;
}

bool kmp_beam_make(kmp_arena *arena, const kmp_beam *beam, kmp_flexible *flexible)
{
    maker m = {.arena = arena, .beam = beam, .to = flexible};
    flexible->count = 0;
    for (int f = 0; f < KMP_BEAM_FAMILIES; f++)
        flexible->count += beam->count[f];
    flexible->stiffening = beam->stiffening;
    flexible->frame = beam->frame;
    flexible->turned = beam->turned;
    memcpy(flexible->axes, beam->axes, sizeof flexible->axes);
    flexible->station_count = beam->station_count;
    flexible->stations = KMP_ARENA_NEW(arena, kmp_station, beam->station_count);
    bool good = flexible->stations && make_all(&m);
    arena->failed = arena->failed || m.scratch.failed;
    kmp_arena_free(&m.scratch);
    for (int k = 0; good && k < flexible->number_count; k++)
        good = isfinite(flexible->numbers[k].value);
    return good;
}

kmp_number kmp_beam_part(kmp_arena *arena, const kmp_beam *beam, int k, kmp_number x)
{
    return kmp_number_scale(arena, beam->turned ? beam->axes[k][0] : k == 0, x);
}

kmp_station *kmp_beam_stations(kmp_arena *arena, const kmp_flexible *flexible, const double *parameters, int count)
{
    const kmp_beam *beam = flexible->beam;
    kmp_flexible own = {.count = flexible->count, .station_count = count};
    maker m = {.arena = arena, .beam = beam, .to = &own};
    own.stations = KMP_ARENA_NEW(arena, kmp_station, count);
    kmp_flexible_lay(&own, NULL);
    kmp_number *numbers = KMP_ARENA_NEW(arena, kmp_number, own.number_count);
    bool made = own.stations && numbers && make_shapes(&m);
    if (made)
        kmp_flexible_lay(&own, numbers);
    for (int k = 0; made && k < count; k++)
        put_station(&m, &own.stations[k], kmp_number_scale(arena, k / fmax(count - 1, 1), beam->length));
    for (int k = 0; made && k < own.number_count; k++)
        if (own.numbers[k].expr)
            own.numbers[k].value = kmp_expr_value(own.numbers[k].expr, parameters);
    kmp_arena_free(&m.scratch);
    return made && !arena->failed ? own.stations : NULL;
}
