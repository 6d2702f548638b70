/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/flexible/modal_body.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/lapack.h"
#include "linalg/dense/three.h"
#include "model/language/number_algebra.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Integrals of solid meshes are zero to 1e-11 of their scale where symmetry makes them zero, and from 1e-8 on where it
 * does not (a blade of 315 nodes). */
static const double ROUNDING = 1e-10;

/* -- eigenvalues ------------------------------------------------------------------------------------- */

/* The matrix is finite: there is no memory where it fails. */
static bool eigen(kmp_arena *arena, int n, double *a, double *values)
{
    const bool good = kmp_symmetric_eigen(n, a, values) == 0;
    arena->failed = arena->failed || !good;
    return good;
}

bool kmp_modal_values(kmp_arena *arena, int n, const double *stiffness, const double *mass, double *values, double *x)
{
    double *l;
    const size_t bytes = (size_t)n * (size_t)n * sizeof *l;
    if (!KMP_ARENA_EACH(arena, double, n *n, &l))
        return false;
    memcpy(l, mass, bytes);
    memcpy(x, stiffness, bytes);
    if (kmp_cholesky_factor(n, l) != 0)
        return false;
    kmp_cholesky_congruence(n, l, x);
    if (!eigen(arena, n, x, values))
        return false;
    for (int k = 0; k < n; k++)
        kmp_cholesky_backward(n, l, x + (ptrdiff_t)n * k);
    return true;
}

static double trace(const double t[9])
{
    return t[0] + t[4] + t[8];
}

static double *field_product(const kmp_modal_body *b, int k, int l)
{
    return b->by_field + 9 * ((ptrdiff_t)k * b->count + l);
}

void kmp_modal_mass(const kmp_modal_body *b, double *mass)
{
    for (int k = 0; k < b->count; k++)
        for (int l = 0; l < b->count; l++)
            mass[k * b->count + l] = trace(field_product(b, k < l ? k : l, k < l ? l : k));
}

bool kmp_modal_integrate(kmp_modal_body *b, ptrdiff_t count, const int *row, const int *col, const double *value)
{
    const int n = b->count;
    const double *phi = b->mode, *x = b->node;
    double *moved; /* sum_j m_ij phi_j */
    if (!KMP_ARENA_MAKE(b->arena, KMP_ROOM(double, 3 * (ptrdiff_t)n * b->node_count, &moved),
                        KMP_ROOM(double, 3 * n, &b->field), KMP_ROOM(double, 9 * n, &b->by_place),
                        KMP_ROOM(double, 9 * n * n, &b->by_field)))
        return false;
    b->mass = 0;
    memset(b->moment, 0, sizeof b->moment);
    memset(b->second, 0, sizeof b->second);
    for (ptrdiff_t e = 0; e < count; e++) {
        const double m = value[e];
        const ptrdiff_t i = row[e], j = col[e];
        b->mass += m;
        for (int a = 0; a < 3; a++)
            b->moment[a] += m * x[3 * i + a];
        for (int a = 0; a < 9; a++)
            b->second[a] += m * x[3 * i + a / 3] * x[3 * j + a % 3];
        for (ptrdiff_t k = 0; k < 3 * (ptrdiff_t)n; k++)
            moved[3 * n * i + k] += m * phi[3 * n * j + k];
    }
    for (ptrdiff_t i = 0; i < b->node_count; i++)
        for (int k = 0; k < n; k++)
            for (int a = 0; a < 3; a++) {
                const double own = moved[(3 * i + a) * n + k];
                b->field[3 * k + a] += own;
                for (int c = 0; c < 3; c++)
                    b->by_place[9 * k + 3 * a + c] += own * x[3 * i + c];
                for (int l = 0; l < n; l++)
                    for (int c = 0; c < 3; c++)
                        b->by_field[9 * ((ptrdiff_t)k * n + l) + 3 * a + c] += own * phi[(3 * i + c) * n + l];
            }
    return true;
}

/* -- rigid motions ----------------------------------------------------------------------------------- */

static void axial(const double y[9], double v[3])
{
    v[0] = y[7] - y[5];
    v[1] = y[2] - y[6];
    v[2] = y[3] - y[1];
}

/* The inertia tensor tr(P) 1 - P. */
static void inertia_of(const double second[9], double inertia[9])
{
    for (int i = 0; i < 9; i++)
        inertia[i] = (i % 4 == 0 ? trace(second) : 0) - second[i];
}

/* The part of the mass between modes that no rigid motion has: the modes less the rigid motions with their momentum and
 * angular momentum about the centre of mass. */
static bool elastic_mass(const kmp_modal_body *b, const double *mass, double *elastic)
{
    const double flat = 1e-12; /* of the largest moment of inertia: the body is a line, and does not resist there */
    const int n = b->count;
    double second[9], axes[9], values[3], centre[3], *spin = kmp_arena_alloc(b->arena, (size_t)n * 3, sizeof *spin);
    for (int i = 0; i < 3; i++)
        centre[i] = b->moment[i] / b->mass;
    for (int i = 0; i < 9; i++)
        second[i] = b->second[i] - b->mass * centre[i / 3] * centre[i % 3];
    inertia_of(second, axes);
    if (!spin || !eigen(b->arena, 3, axes, values))
        return false;
    for (int k = 0; k < n; k++) {
        double z[9];
        for (int i = 0; i < 9; i++)
            z[i] = b->by_place[9 * k + i] - b->field[3 * k + i / 3] * centre[i % 3];
        axial(z, spin + 3 * (ptrdiff_t)k);
    }
    for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++) {
            double sum = mass[k * n + l] - kmp_dot3(b->field + 3 * (ptrdiff_t)k, b->field + 3 * (ptrdiff_t)l) / b->mass;
            for (int i = 0; i < 3; i++)
                if (values[i] > flat * values[2])
                    sum -= kmp_dot3(spin + 3 * (ptrdiff_t)k, axes + 3 * i) *
                           kmp_dot3(spin + 3 * (ptrdiff_t)l, axes + 3 * i) / values[i];
            elastic[k * n + l] = sum;
        }
    return true;
}

/* By count: as many values of stiffness must be zero as there are rigid motions, relative to the first elastic one. */
static bool check_stiffness(int n, int rigid, const double *values, kmp_text *why)
{
    const double small = 1e-6;     /* of the first elastic value: single precision in other programs leaves 1e-7 */
    const double rounding = 1e-12; /* of the largest value */
    int zeros = 0;
    for (int k = 0; k < n; k++)
        zeros += fabs(values[k]) <= rounding * values[n - 1];
    if (values[0] < -small * values[rigid < n ? rigid : n - 1])
        kmp_text_printf(why,
                        "the stiffness K is negative: its least value x'Kx/x'Mx is %.3g 1/s^2, the largest %.3g; write "
                        "the matrix of the body without load, with all digits",
                        values[0], values[n - 1]);
    else if (rigid > 0 && rigid < n && values[rigid - 1] > small * values[rigid])
        kmp_text_printf(why,
                        "the modes have %d rigid motion%s, and K resists them: its value %d is %.3g 1/s^2 (first "
                        "elastic mode %.3g); K must be the stiffness of the free body",
                        rigid, rigid == 1 ? "" : "s", rigid, values[rigid - 1], values[rigid]);
    else if (zeros > rigid)
        kmp_text_printf(why,
                        "K has %d value%s of zero, and the modes have %d rigid motion%s: other motions without "
                        "stiffness; join the parts of the body, or leave these modes out",
                        zeros, zeros == 1 ? "" : "s", rigid, rigid == 1 ? "" : "s");
    return why->length == 0;
}

int kmp_modal_rigid(const kmp_modal_body *b, double *elastic, kmp_text *why)
{
    const double none = 1e-8; /* part of a mode's mass that is not rigid: the square of 1e-4 in its displacement */
    const int n = b->count;
    int rigid = 0;
    double *mass, *rest, *values, *x;
    if (!KMP_ARENA_MAKE(b->arena, KMP_ROOM(double, n *n, &mass, &rest, &x), KMP_ROOM(double, n, &values)))
        return -1;
    kmp_modal_mass(b, mass);
    if (!elastic_mass(b, mass, rest))
        return -1;
    if (!kmp_modal_values(b->arena, n, rest, mass, values, elastic)) {
        if (!b->arena->failed)
            kmp_text_put(why,
                         "the mass of the modes, the traces of T, is not positive: two modes are alike, or one moves "
                         "no mass; leave them out");
        return -1;
    }
    if (values[0] < -none) {
        kmp_text_printf(why,
                        "the mass of body and modes is not positive (%.3g of 1): S, Z0, T, m, b0 and P0 (Ct, Cr, Me, "
                        "mass, mdCM and J) belong to different masses",
                        values[0]);
        return -1;
    }
    while (rigid < n && values[rigid] < none)
        rigid++;
    if (!kmp_modal_values(b->arena, n, b->stiffness, mass, values, x) || !check_stiffness(n, rigid, values, why))
        return -1;
    memmove(elastic, elastic + (ptrdiff_t)rigid * n, (size_t)(n - rigid) * (size_t)n * sizeof *elastic);
    return rigid;
}

/* -- changes of origin, frame and modes -------------------------------------------------------------- */

/* y += factor a b' */
static void add_outer(double y[9], double factor, const double a[3], const double b[3])
{
    for (int i = 0; i < 9; i++)
        y[i] += factor * a[i / 3] * b[i % 3];
}

void kmp_modal_move_origin(kmp_modal_body *b, const double x[3])
{
    add_outer(b->second, -1, b->moment, x);
    add_outer(b->second, -1, x, b->moment);
    add_outer(b->second, b->mass, x, x);
    for (int k = 0; k < b->count; k++)
        add_outer(b->by_place + 9 * (ptrdiff_t)k, -1, b->field + 3 * (ptrdiff_t)k, x);
    const ptrdiff_t all = (ptrdiff_t)b->count * b->count;
    for (int i = 0; i < 9 && b->second_more && b->moment_more; i++)
        for (ptrdiff_t k = 0; k < all; k++)
            b->second_more[i * all + k] -= b->moment_more[i / 3 * all + k] * x[i % 3];
    for (int i = 0; i < 3; i++)
        b->moment[i] -= b->mass * x[i];
    for (ptrdiff_t k = 0; k < 3 * (ptrdiff_t)b->node_count; k++)
        b->node[k] -= x[k % 3];
    for (int p = 0; p < b->place_count; p++)
        for (int i = 0; i < 3; i++)
            b->places[p].at[i] -= x[i];
}

/* The rigid motion that has the momentum and the angular momentum of each mode: n x 6. False: the body has no inertia
 * about an axis. */
static bool mean_of(const kmp_modal_body *b, double *rigid)
{
    const double *p = b->second, *c = b->moment, all = p[0] + p[4] + p[8];
    const double cross[9] = {0, -c[2], c[1], c[2], 0, -c[0], -c[1], c[0], 0};
    double inertia[36] = {0};
    for (int i = 0; i < 3; i++) {
        inertia[7 * i] = b->mass;
        for (int j = 0; j < 3; j++) {
            inertia[(3 + i) + 6 * j] = inertia[j + 6 * (3 + i)] = cross[3 * i + j];
            inertia[(3 + i) + 6 * (3 + j)] = (i == j ? all : 0) - (p[3 * i + j] + p[3 * j + i]) / 2;
        }
    }
    if (kmp_cholesky_factor(6, inertia) != 0)
        return false;
    for (int k = 0; k < b->count; k++) {
        double *own = rigid + 6 * (ptrdiff_t)k;
        const double *z = b->by_place + 9 * (ptrdiff_t)k;
        for (int i = 0; i < 3; i++) {
            own[i] = b->field[3 * k + i];
            own[3 + i] = z[3 * ((i + 2) % 3) + (i + 1) % 3] - z[3 * ((i + 1) % 3) + (i + 2) % 3];
        }
        kmp_cholesky_solve(6, inertia, own);
    }
    return true;
}

bool kmp_modal_frame(const kmp_modal_body *b, kmp_flexible_frame frame, double *rigid)
{
    const int n = b->count;
    if (frame == KMP_FRAME_MEAN)
        return mean_of(b, rigid);
    const kmp_modal_place *a = &b->places[0], *c = frame == KMP_FRAME_CHORD ? &b->places[1] : a;
    const double *x = c->at;
    const double square = kmp_dot3(x, x);
    for (int k = 0; k < n; k++) {
        double *own = rigid + 6 * (ptrdiff_t)k, apart[3], turn[3];
        for (int i = 0; i < 3; i++) {
            own[i] = a->shift[n * i + k];
            turn[i] = a->turn[n * i + k];
            apart[i] = c->shift[n * i + k] - own[i];
        }
        memcpy(own + 3, turn, sizeof turn);
        if (frame != KMP_FRAME_CHORD)
            continue;
        double across[3];
        const double about = kmp_dot3(x, turn) / square;
        kmp_cross3(x, apart, across);
        for (int i = 0; i < 3; i++)
            own[3 + i] = across[i] / square + about * x[i];
    }
    return true;
}

/* y += factor * w~ p, and y += factor * p w~', of 3 x 3 matrices; w~ p is the columns w x p. */
static void add_turned(double y[9], double factor, const double w[3], const double p[9])
{
    for (int j = 0; j < 3; j++) {
        double turned[3];
        kmp_cross3(w, (double[3]){p[j], p[3 + j], p[6 + j]}, turned);
        for (int i = 0; i < 3; i++)
            y[3 * i + j] += factor * turned[i];
    }
}

static void add_turned_right(double y[9], double factor, const double p[9], const double w[3])
{
    for (int i = 0; i < 3; i++) {
        double turned[3];
        kmp_cross3(w, p + 3 * i, turned);
        for (int j = 0; j < 3; j++)
            y[3 * i + j] += factor * turned[j];
    }
}

/* int R_k X' dm of a rigid motion R = c + w x X. */
static void place_of_rigid(const kmp_modal_body *b, const double rigid[6], double z[9])
{
    memset(z, 0, 9 * sizeof *z);
    add_outer(z, 1, rigid, b->moment);
    add_turned(z, 1, rigid + 3, b->second);
}

/* int R dm. */
static void field_of_rigid(const kmp_modal_body *b, const double rigid[6], double s[3])
{
    kmp_cross3(rigid + 3, b->moment, s);
    for (int i = 0; i < 3; i++)
        s[i] += b->mass * rigid[i];
}

/* int phi phi' dm less the rigid motions of both, from the integrals of phi before these are subtracted. */
static void subtract_product(const kmp_modal_body *b, int k, int l, const double *rigid)
{
    const double *a = rigid + 6 * (ptrdiff_t)k, *c = rigid + 6 * (ptrdiff_t)l;
    double *t = field_product(b, k, l), s[3], z[9], transposed[9];
    add_outer(t, -1, b->field + 3 * (ptrdiff_t)k, c);
    add_turned_right(t, -1, b->by_place + 9 * (ptrdiff_t)k, c + 3);
    add_outer(t, -1, a, b->field + 3 * (ptrdiff_t)l);
    for (int i = 0; i < 9; i++)
        transposed[i] = b->by_place[9 * l + i % 3 * 3 + i / 3];
    add_turned(t, -1, a + 3, transposed);
    field_of_rigid(b, a, s);
    place_of_rigid(b, a, z);
    add_outer(t, 1, s, c);
    add_turned_right(t, 1, z, c + 3);
}

static void subtract_at(double *shift, double *turn, int n, const double x[3], const double *rigid)
{
    for (int k = 0; k < n; k++) {
        double way[3];
        kmp_cross3(rigid + 6 * (ptrdiff_t)k + 3, x, way);
        for (int i = 0; i < 3; i++) {
            shift[n * i + k] -= rigid[6 * k + i] + way[i];
            if (turn)
                turn[n * i + k] -= rigid[6 * k + 3 + i];
        }
    }
}

void kmp_modal_subtract(kmp_modal_body *b, const double *rigid)
{
    const int n = b->count;
    for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++)
            subtract_product(b, k, l, rigid);
    for (int k = 0; k < n; k++) {
        double s[3], z[9];
        field_of_rigid(b, rigid + 6 * (ptrdiff_t)k, s);
        place_of_rigid(b, rigid + 6 * (ptrdiff_t)k, z);
        for (int i = 0; i < 3; i++)
            b->field[3 * k + i] -= s[i];
        for (int i = 0; i < 9; i++)
            b->by_place[9 * k + i] -= z[i];
    }
    for (int i = 0; i < b->node_count; i++)
        subtract_at(b->mode + 3 * (ptrdiff_t)n * i, NULL, n, b->node + 3 * (ptrdiff_t)i, rigid);
    for (int p = 0; p < b->place_count; p++)
        subtract_at(b->places[p].shift, b->places[p].turn, n, b->places[p].at, rigid);
}

/* Keeps the trace of a matrix in equal parts, and its axial part, if these are wanted. */
static void average(double y[9], bool trace_part, bool axial_part)
{
    const double mean = trace_part ? trace(y) / 3 : 0;
    const double half[3] = {(y[7] - y[5]) / 2, (y[2] - y[6]) / 2, (y[3] - y[1]) / 2};
    for (int i = 0; i < 9; i++)
        y[i] = i % 4 == 0 ? mean : 0;
    for (int i = 0; i < 3 && axial_part; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        y[3 * k + j] = half[i];
        y[3 * j + k] = -half[i];
    }
}

void kmp_modal_average(kmp_modal_body *b)
{
    for (int k = 0; k < b->count && b->known == KMP_MODAL_AXIAL; k++)
        average(b->by_place + 9 * (ptrdiff_t)k, false, true);
    for (ptrdiff_t k = 0; k < (ptrdiff_t)b->count * b->count && b->known != KMP_MODAL_ALL; k++)
        average(b->by_field + 9 * k, true, b->known == KMP_MODAL_TRACES);
}

/* Rows of n numbers become rows of their combinations. */
static bool combine_rows(kmp_modal_body *b, double **rows, ptrdiff_t row_count, int count, const double *v)
{
    const int n = b->count;
    const double *from = *rows;
    double *to = from ? kmp_arena_alloc(b->arena, (size_t)row_count * (size_t)count + 1, sizeof *to) : NULL;
    for (ptrdiff_t i = 0; to && i < row_count; i++)
        for (int k = 0; k < count; k++) {
            double sum = 0;
            for (int e = 0; e < n; e++)
                sum += from[i * n + e] * v[k * n + e];
            to[i * count + k] = sum;
        }
    *rows = to;
    return to || !from;
}

/* Blocks of `width` numbers for each mode become blocks of combinations. */
static bool combine_blocks(kmp_modal_body *b, double **blocks, int outer, int width, int count, const double *v)
{
    const int n = b->count;
    const double *from = *blocks;
    double *to = kmp_arena_alloc(b->arena, (size_t)outer * (size_t)count * (size_t)width + 1, sizeof *to);
    for (ptrdiff_t o = 0; to && o < outer; o++)
        for (int k = 0; k < count; k++)
            for (int e = 0; e < n; e++)
                for (int i = 0; i < width; i++)
                    to[(o * count + k) * width + i] += v[k * n + e] * from[(o * n + e) * width + i];
    *blocks = to;
    return to;
}

/* `outer` matrices n x n become v matrix v'. */
static bool combine_both(kmp_modal_body *b, double **matrices, int outer, int count, const double *v)
{
    return !*matrices || (combine_rows(b, matrices, (ptrdiff_t)outer * b->count, count, v) &&
                          combine_blocks(b, matrices, outer, count, count, v));
}

bool kmp_modal_combine(kmp_modal_body *b, int count, const double *v)
{
    const int n = b->count;
    bool good = combine_blocks(b, &b->field, 1, 3, count, v) && combine_blocks(b, &b->by_place, 1, 9, count, v) &&
                combine_blocks(b, &b->by_field, n, 9, count, v) &&
                combine_blocks(b, &b->by_field, 1, 9 * count, count, v) &&
                combine_both(b, &b->stiffness, 1, count, v) && combine_both(b, &b->damping, 1, count, v) &&
                combine_both(b, &b->moment_more, 3, count, v) && combine_both(b, &b->second_more, 9, count, v) &&
                combine_rows(b, &b->mode, 3 * (ptrdiff_t)b->node_count, count, v);
    for (int p = 0; p < b->place_count && good; p++)
        good = combine_rows(b, &b->places[p].shift, 3, count, v) && combine_rows(b, &b->places[p].turn, 3, count, v) &&
               combine_both(b, &b->places[p].more, 3, count, v);
    b->count = count;
    return good;
}

/* -- places by nodes --------------------------------------------------------------------------------- */

int kmp_modal_find_node(const kmp_modal_body *b, double number)
{
    int low = 0, high = b->node_count;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if ((b->number ? b->number[middle] : middle) < number)
            low = middle + 1;
        else
            high = middle;
    }
    return low < b->node_count && (b->number ? b->number[low] : low) == number ? low : -1;
}

static void centre_of(const kmp_modal_body *b, int count, const int *nodes, double centre[3])
{
    for (int i = 0; i < 3; i++) {
        centre[i] = 0;
        for (int k = 0; k < count; k++)
            centre[i] += b->node[3 * nodes[k] + i] / count;
    }
}

/* The moments of inertia of nodes about their centre, and their axes, as columns. */
static bool spread_of(const kmp_modal_body *b, int count, const int *nodes, const double centre[3], double values[3],
                      double axes[9])
{
    double second[9] = {0};
    for (int k = 0; k < count; k++) {
        double r[3];
        for (int i = 0; i < 3; i++)
            r[i] = b->node[3 * nodes[k] + i] - centre[i];
        add_outer(second, 1, r, r);
    }
    inertia_of(second, axes);
    return eigen(b->arena, 3, axes, values);
}

/* The rotation that the displacements of nodes have by least squares. */
static void fit_turn(const kmp_modal_body *b, int count, const int *nodes, const double centre[3],
                     const double values[3], const double axes[9], double *turn)
{
    const int n = b->count;
    for (int k = 0; k < n; k++) {
        double spin[3] = {0};
        for (int i = 0; i < count; i++) {
            const double *x = b->node + 3 * (ptrdiff_t)nodes[i], *u = b->mode + 3 * (ptrdiff_t)n * nodes[i] + k;
            const double r[3] = {x[0] - centre[0], x[1] - centre[1], x[2] - centre[2]};
            double part[3];
            kmp_cross3(r, (double[3]){u[0], u[n], u[2 * n]}, part);
            for (int c = 0; c < 3; c++)
                spin[c] += part[c];
        }
        for (int e = 0; e < 3; e++)
            for (int c = 0; c < 3; c++)
                turn[n * c + k] += kmp_dot3(axes + 3 * e, spin) / values[e] * axes[3 * e + c];
    }
}

typedef struct far {
    double square;
    int node;
} far;

static int compare_far(const void *a, const void *b)
{
    const far *x = a, *y = b;
    return x->square != y->square ? (x->square < y->square ? -1 : 1) : (x->node > y->node) - (x->node < y->node);
}

/* The nodes nearest to one that spread in two directions, all that are as far as the last one among them. Their number
 * in `nodes`; 0: all are in a line. */
static int nodes_about(const kmp_modal_body *b, int node, int *nodes, far *order)
{
    const double wide = 0.05; /* the least of their moments of inertia, of the largest; 0: a line, 0.5: a disc */
    const double equal = 1e-6;
    double centre[3], values[3], axes[9];
    for (int k = 0; k < b->node_count; k++) {
        order[k] = (far){.node = k};
        for (int i = 0; i < 3; i++)
            order[k].square += pow(b->node[3 * k + i] - b->node[3 * node + i], 2);
    }
    qsort(order, (size_t)b->node_count, sizeof *order, compare_far);
    for (int k = 0; k < b->node_count; k++) {
        nodes[k] = order[k].node;
        if (k < 2 || (k + 1 < b->node_count && order[k + 1].square <= order[k].square * (1 + equal)))
            continue;
        centre_of(b, k + 1, nodes, centre);
        if (spread_of(b, k + 1, nodes, centre, values, axes) && values[0] > wide * values[2])
            return k + 1;
    }
    return 0;
}

int kmp_modal_add_nodes(kmp_modal_body *b, int count, const int *nodes)
{
    const double line = 1e-9; /* of the largest moment of inertia */
    const int n = b->count;
    kmp_modal_place place = {.at = {0}};
    double centre[3], values[3], axes[9];
    int *about;
    far *order;
    if (!KMP_ARENA_GROW(b->arena, b->places, b->place_count) ||
        !KMP_ARENA_MAKE(b->arena, KMP_ROOM(double, 3 * n, &place.shift, &place.turn),
                        KMP_ROOM(int, b->node_count, &about), KMP_ROOM(far, b->node_count, &order)))
        return -1;
    centre_of(b, count, nodes, place.at);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3 * n; k++)
            place.shift[k] += b->mode[3 * (ptrdiff_t)n * nodes[i] + k] / count;
    if (count == 1) {
        count = nodes_about(b, nodes[0], about, order);
        nodes = about;
    }
    if (count == 0)
        return -1;
    centre_of(b, count, nodes, centre);
    if (!spread_of(b, count, nodes, centre, values, axes) || !(values[0] > line * values[2]))
        return -1;
    fit_turn(b, count, nodes, centre, values, axes, place.turn);
    b->places[b->place_count] = place;
    return b->place_count++;
}

/* -- zeros ------------------------------------------------------------------------------------------- */

static void clear_below(double *value, ptrdiff_t count, double scale)
{
    for (ptrdiff_t k = 0; k < count; k++)
        if (fabs(value[k]) <= ROUNDING * scale)
            value[k] = 0;
}

static double largest_of_three(const double *value, ptrdiff_t first, ptrdiff_t step)
{
    double largest = 0;
    for (int k = 0; k < 3; k++)
        largest = fmax(largest, fabs(value[first + k * step]));
    return largest;
}

/* Modes without mass between them have none exactly: the last part of the trace that is not zero is less the others. */
static void clear_trace(double t[9], double scale)
{
    if (fabs(trace(t)) > ROUNDING * scale)
        return;
    if (t[8] != 0)
        t[8] = -(t[0] + t[4]);
    else
        t[4] = -t[0];
}

/* A place's parts that are small compared with the largest of its mode at all places. */
static void clear_places(kmp_modal_body *b)
{
    const int n = b->count;
    for (int k = 0; k < n; k++) {
        double shift = 0, turn = 0;
        for (int p = 0; p < b->place_count; p++) {
            shift = fmax(shift, largest_of_three(b->places[p].shift, k, n));
            turn = fmax(turn, largest_of_three(b->places[p].turn, k, n));
        }
        for (int i = 0; i < b->node_count; i++)
            shift = fmax(shift, largest_of_three(b->mode + 3 * (ptrdiff_t)n * i, k, n));
        for (int p = 0; p < b->place_count; p++)
            for (int i = 0; i < 3; i++) {
                clear_below(&b->places[p].shift[n * i + k], 1, shift);
                clear_below(&b->places[p].turn[n * i + k], 1, turn);
            }
    }
}

static void clear(kmp_modal_body *b)
{
    const int n = b->count;
    const double size = sqrt(b->mass * trace(b->second));
    clear_below(b->second, 9, trace(b->second));
    clear_below(b->moment, 3, size);
    for (int k = 0; k < n; k++) {
        const double own = sqrt(trace(field_product(b, k, k))), stiff = b->stiffness[k * n + k];
        clear_below(b->field + 3 * (ptrdiff_t)k, 3, own * sqrt(b->mass));
        clear_below(b->by_place + 9 * (ptrdiff_t)k, 9, own * sqrt(trace(b->second)));
        for (int l = 0; l < n; l++) {
            const double other = l < k ? sqrt(trace(field_product(b, l, l))) : 0;
            if (l < k) {
                clear_below(field_product(b, l, k), 9, own * other);
                clear_trace(field_product(b, l, k), own * other);
                clear_below(&b->stiffness[k * n + l], 1, sqrt(stiff * b->stiffness[l * n + l]));
                b->stiffness[l * n + k] = b->stiffness[k * n + l];
            }
        }
    }
    for (int k = 0; k < n; k++)
        clear_below(field_product(b, k, k), 9, trace(field_product(b, k, k)));
    clear_places(b);
}

/* -- the model's numbers ----------------------------------------------------------------------------- */

static void put(kmp_number *to, ptrdiff_t count, const double *from)
{
    for (ptrdiff_t k = 0; k < count; k++)
        to[k] = (kmp_number){.value = from[k]};
}

static bool is_zero(const double *value, int count)
{
    bool zero = true;
    for (int k = 0; k < count; k++)
        zero = zero && value[k] == 0;
    return zero;
}

/* The forms of second order: one function for each that is not zero, which moves its component by a unit. */
static void put_forms(const kmp_modal_body *b, kmp_flexible *f)
{
    const int n = b->count;
    int used = 0;
    for (int i = 0; i < 12; i++) {
        const double *form =
            i < 3 ? b->moment_more + (ptrdiff_t)i * n * n : b->second_more + (ptrdiff_t)(i - 3) * n * n;
        if (is_zero(form, n * n))
            continue;
        if (f->numbers) {
            put(f->quadratic + (ptrdiff_t)used * n * n, (ptrdiff_t)n * n, form);
            if (i < 3)
                f->field[3 * (n + used) + i].value = 1;
            else
                f->by_place[9 * (n + used) + i - 3].value = 1;
        }
        used++;
    }
    f->quadratic_count = used;
}

static void put_fields(const kmp_modal_body *b, kmp_flexible *f)
{
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    const int n = b->count, all = n + f->quadratic_count;
    f->mass->value = b->mass;
    put(f->moment, 3, b->moment);
    for (int e = 0; e < 6; e++)
        f->second[e].value = (b->second[3 * row[e] + column[e]] + b->second[3 * column[e] + row[e]]) / 2;
    put(f->field, 3 * (ptrdiff_t)n, b->field);
    put(f->by_place, 9 * (ptrdiff_t)n, b->by_place);
    for (int k = 0; k < n; k++)
        for (int l = k; l < n; l++)
            for (int i = 0; i < 9; i++) {
                const double t = field_product(b, k, l)[i];
                f->by_field[9 * ((ptrdiff_t)all * k + l) + i].value = t;
                f->by_field[9 * ((ptrdiff_t)all * l + k) + i % 3 * 3 + i / 3].value = t;
            }
    put(f->stiffness, (ptrdiff_t)n * n, b->stiffness);
}

/* The angles of second order belong to a rotation about the vector that is linear in the coordinates. */
static void put_place(const kmp_modal_body *b, const kmp_modal_place *place, bool first, kmp_station *to)
{
    static const double sign[3] = {0.5, -0.5, 0.5};
    const int n = b->count;
    put(to->at, 3, place->at);
    put(to->shift, 3 * (ptrdiff_t)n, place->shift);
    put(to->turn, 3 * (ptrdiff_t)n, place->turn);
    if (!first)
        return;
    put(to->shift_more, 3 * (ptrdiff_t)n * n, place->more);
    for (int i = 0; i < 3; i++) {
        const double *a = place->turn + (ptrdiff_t)n * (i == 0), *c = place->turn + (ptrdiff_t)n * (i == 2 ? 1 : 2);
        for (int k = 0; k < n; k++)
            for (int l = 0; l < n; l++)
                to->turn_more[((ptrdiff_t)i * n + k) * n + l].value = sign[i] * (a[k] * c[l] + c[k] * a[l]);
    }
}

static bool put_damping(kmp_arena *arena, const kmp_modal_body *b, bool damped, kmp_number ratio,
                        const kmp_number rayleigh[2], kmp_flexible *f)
{
    const int n = b->count;
    double *mass, *values, *x, *load;
    if (b->damping && !damped) {
        put(f->damping, (ptrdiff_t)n * n, b->damping);
        return true;
    }
    if (!KMP_ARENA_MAKE(b->arena, KMP_ROOM(double, n *n, &mass, &x, &load), KMP_ROOM(double, n, &values)))
        return false;
    kmp_modal_mass(b, mass);
    if (!kmp_modal_values(b->arena, n, b->stiffness, mass, values, x))
        return false;
    for (int k = 0; k < n; k++)
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                load[k * n + i] += mass[i * n + j] * x[k * n + j];
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double sum = 0;
            for (int k = 0; k < n; k++)
                sum += 2 * sqrt(fmax(values[k], 0)) * load[k * n + i] * load[k * n + j];
            const double scale = 2 * sqrt(values[n - 1] * mass[i * n + i] * mass[j * n + j]);
            kmp_number *d = &f->damping[i * n + j];
            *d = kmp_number_scale(arena, fabs(sum) > ROUNDING * scale ? sum : 0, ratio);
            *d = kmp_number_add(arena, *d, kmp_number_scale(arena, mass[i * n + j], rayleigh[0]));
            *d = kmp_number_add(arena, *d, kmp_number_scale(arena, b->stiffness[i * n + j], rayleigh[1]));
        }
    return true;
}

bool kmp_modal_make(kmp_arena *arena, kmp_modal_body *b, bool damped, kmp_number ratio, const kmp_number rayleigh[2],
                    kmp_flexible *f)
{
    const bool first = f->stiffening == KMP_STIFFENING_FIRST;
    clear(b);
    f->count = b->count;
    f->numbers = NULL;
    if (first)
        put_forms(b, f);
    f->station_count = b->place_count;
    f->stations = KMP_ARENA_NEW(arena, kmp_station, b->place_count);
    if (!f->stations)
        return false;
    kmp_flexible_lay(f, NULL);
    kmp_number *numbers = KMP_ARENA_NEW(arena, kmp_number, f->number_count);
    if (!numbers)
        return false;
    kmp_flexible_lay(f, numbers);
    /* The farthest node or place from the origin. */
    double square = 0;
    for (int i = 0; i < b->node_count; i++)
        square = fmax(square, kmp_dot3(b->node + 3 * (ptrdiff_t)i, b->node + 3 * (ptrdiff_t)i));
    for (int p = 0; p < b->place_count; p++)
        square = fmax(square, kmp_dot3(b->places[p].at, b->places[p].at));
    f->length->value = square > 0 ? sqrt(square) : sqrt(trace(b->second) / b->mass);
    put_fields(b, f);
    if (first)
        put_forms(b, f);
    for (int p = 0; p < b->place_count; p++)
        put_place(b, &b->places[p], first, &f->stations[p]);
    f->moved = kmp_flexible_joint_moves(f);
    return put_damping(arena, b, damped, ratio, rayleigh, f);
}
