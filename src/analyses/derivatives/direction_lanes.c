/* SPDX-License-Identifier: BSD-3-Clause */
/* Every sum goes over the terms that are not zero for every state, in the order of the loops for one direction. Zeros
 * of X, M and the factor are listed once for a choice. */
#include "analyses/derivatives/direction_lanes.h"
#include "base/memory.h"
#include "linalg/wide_rows.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* -- lists of terms -------------------------------------------------------------------------------------- */

/* Lists the same terms by their rows: `from` stays, and the sum becomes the row. */
static bool transpose_terms(kmp_arena *arena, const kmp_terms *terms, int sums, int rows, kmp_terms *out)
{
    const int count = terms->start[sums];
    if (!kmp_terms_make(arena, rows, count, out))
        return false;
    for (int e = 0; e < count; e++)
        out->start[terms->at[e] + 1]++;
    for (int i = 0; i < rows; i++)
        out->start[i + 1] += out->start[i];
    for (int k = 0; k < sums; k++)
        for (int e = terms->start[k]; e < terms->start[k + 1]; e++) {
            const int to = out->start[terms->at[e]]++;
            out->at[to] = k;
            out->from[to] = terms->from[e];
        }
    for (int i = rows; i > 0; i--)
        out->start[i] = out->start[i - 1];
    out->start[0] = 0;
    return true;
}

/* -- preparation ----------------------------------------------------------------------------------------- */

/* Rows of X by columns, and of Bvu the columns by rows. */
static bool list_tangent(kmp_direction_lanes *x)
{
    const kmp_reduction *red = x->red;
    const kmp_sparse_tangent *z = red->zeros;
    const int n = x->n, p = x->p, r = x->r, most = z ? z->x_start[p] : p * (r + 1);
    kmp_terms by_u;
    if (!kmp_terms_make(&x->arena, p, most, &x->x) || !kmp_terms_make(&x->arena, p, most, &by_u))
        return false;
    for (int c = 0; c < p; c++) {
        const int k = x->order[c], begin = z ? z->x_start[k] : 0, end = z ? z->x_start[k + 1] : n;
        kmp_terms_begin(&x->x, c);
        for (int e = begin; e < end; e++) {
            const int i = z ? z->x_row[e] : e;
            if (red->place[i] >= 0 || red->place[i] == -1 - k)
                kmp_terms_add(&x->x, c, i, i + k * n);
        }
    }
    for (int k = 0; k < p; k++) {
        kmp_terms_begin(&by_u, k);
        for (int e = x->x.start[x->place[k]]; e < x->x.start[x->place[k] + 1]; e++)
            if (red->place[x->x.at[e]] >= 0)
                kmp_terms_add(&by_u, k, red->place[x->x.at[e]], red->place[x->x.at[e]] + k * r);
    }
    if (!transpose_terms(&x->arena, &by_u, p, r, &x->moved))
        return false;
    for (int e = 0; e < x->moved.start[r]; e++)
        x->moved.at[e] = x->place[x->moved.at[e]];
    return true;
}

static bool list_factor(kmp_direction_lanes *x)
{
    const kmp_sparse_tangent *z = x->red->zeros;
    const int p = x->p, stride = z ? z->stride : p;
    if (!kmp_terms_make(&x->arena, p, z ? z->l.start[p] : p * (p - 1) / 2, &x->below))
        return false;
    for (int c = 0; c < p; c++) {
        kmp_terms_begin(&x->below, c);
        for (int e = z ? z->l.start[c] : c + 1, end = z ? z->l.start[c + 1] : p; e < end; e++)
            kmp_terms_add(&x->below, c, z ? z->l.at[e] : e, c * stride + (z ? z->l.at[e] : e));
    }
    return transpose_terms(&x->arena, &x->below, p, p, &x->lower);
}

static bool list_mass(kmp_direction_lanes *x)
{
    const kmp_pattern *m = &x->red->eval->system->mass;
    kmp_terms by_entry; /* two sums for each entry: of its row and of its column */
    if (!kmp_terms_make(&x->arena, 2 * m->count, 2 * m->count, &by_entry))
        return false;
    for (int k = 0; k < m->count; k++)
        for (int side = 0; side < 2; side++) {
            kmp_terms_begin(&by_entry, 2 * k + side);
            if (side == 0 || m->row[k] != m->col[k])
                kmp_terms_add(&by_entry, 2 * k + side, side ? m->col[k] : m->row[k], k);
        }
    if (!transpose_terms(&x->arena, &by_entry, 2 * m->count, x->n, &x->mass) ||
        !kmp_terms_make(&x->arena, x->n, 2 * m->count, &x->mass_by))
        return false;
    for (int i = 0; i < x->n; i++) {
        kmp_terms_begin(&x->mass_by, i);
        for (int e = x->mass.start[i]; e < x->mass.start[i + 1]; e++) {
            const int side = x->mass.at[e] % 2, k = x->mass.from[e], other = side ? m->row[k] : m->col[k];
            x->mass.at[e] = other;
            if (x->red->place[other] >= 0)
                kmp_terms_add(&x->mass_by, i, x->red->place[other], k);
        }
    }
    return true;
}

bool kmp_direction_lanes_init(kmp_direction_lanes *lanes, int n, int m, const kmp_reduction *red)
{
    *lanes = (kmp_direction_lanes){.red = red, .n = n, .m = m, .p = red ? red->p : 0, .r = red ? red->r : 0};
    const int p = lanes->p, r = lanes->r;
    const struct {
        double **rows;
        int count;
    } room[] = {{&lanes->force, n},  {&lanes->curve, m}, {&lanes->h, m},      {&lanes->rate, m},
                {&lanes->dq, n},     {&lanes->dqd, n},   {&lanes->udd, p},    {&lanes->qdd, n},
                {&lanes->lambda, m}, {&lanes->right, r}, {&lanes->solved, r}, {&lanes->load, n}};
    for (size_t k = 0; k < sizeof room / sizeof *room; k++)
        *room[k].rows = kmp_arena_aligned(&lanes->arena, (size_t)KMP_DIRECTIONS * (size_t)room[k].count + 1);
    const bool made = KMP_ARENA_EACH(&lanes->arena, int, p, &lanes->order, &lanes->place) &&
                      KMP_ARENA_EACH(&lanes->arena, int, 2 * p, &lanes->unit);
    for (int c = 0; made && c < p; c++) {
        lanes->order[c] = red->zeros ? red->zeros->order[c] : c;
        lanes->place[lanes->order[c]] = c;
    }
    if (made && (!red || (list_tangent(lanes) && list_factor(lanes) && list_mass(lanes))))
        return true;
    kmp_direction_lanes_free(lanes);
    return false;
}

KMP_CLEARS(kmp_direction_lanes, lanes, kmp_arena_free(&lanes->arena))

/* -- rows of lanes --------------------------------------------------------------------------------------- */

/* sum += the terms of sum k. */
static KMP_INTO_CLONES void add_terms(int fours, const kmp_terms *of, int k, const double *value, const double *rows,
                                      kmp_four *sum)
{
    for (int e = of->start[k]; e < of->start[k + 1]; e++)
        kmp_wide_add(fours, value[of->from[e]], KMP_WIDE_ROW(fours, rows, of->at[e]), sum);
}

static KMP_INTO_CLONES void subtract_terms(int fours, const kmp_terms *of, int k, const double *value,
                                           const double *rows, kmp_four *sum)
{
    for (int e = of->start[k]; e < of->start[k + 1]; e++)
        kmp_wide_subtract(fours, value[of->from[e]], KMP_WIDE_ROW(fours, rows, of->at[e]), sum);
}

void kmp_direction_lanes_begin(kmp_direction_lanes *lanes, int count, bool follows)
{
    const int width = kmp_wide(count);
    const size_t row = (size_t)width * sizeof(double);
    lanes->width = width;
    memset(lanes->force, 0, (size_t)lanes->n * row);
    memset(lanes->curve, 0, (size_t)lanes->m * row);
    if (!follows)
        return;
    memset(lanes->h, 0, (size_t)lanes->m * row);
    memset(lanes->rate, 0, (size_t)lanes->m * row);
    for (int l = 0; l < KMP_DIRECTIONS; l++)
        lanes->u[l] = lanes->ud[l] = -1;
}

void kmp_direction_lanes_add_column(const kmp_direction_lanes *lanes, const kmp_tangents *tangents,
                                    kmp_tangent_block block, const double *d, int column, int lane, double *out)
{
    const int *start = tangents->column + tangents->first_column[block] + column;
    for (int k = start[0]; k < start[1]; k++) {
        const kmp_tangent *e = &tangents->entry[k];
        out[(ptrdiff_t)e->row * lanes->width + lane] += d[e->source];
    }
}

/* By tiles of four numbers of four lanes. */
static KMP_CLONES void put_columns(ptrdiff_t width, int rows, const int *from, const double *values, int count,
                                   double *columns)
{
    const ptrdiff_t ld = rows;
    int l = 0;
    for (; l + KMP_FOUR <= count; l += KMP_FOUR) {
        int k = 0;
        for (; k + KMP_FOUR <= rows; k += KMP_FOUR) {
            const double *row[KMP_FOUR];
            for (int i = 0; i < KMP_FOUR; i++)
                row[i] = values + (from ? from[k + i] : k + i) * width + l;
            kmp_wide_transpose(row, ld, columns + l * ld + k);
        }
        for (; k < rows; k++)
            for (int i = 0; i < KMP_FOUR; i++)
                columns[(l + i) * ld + k] = values[(from ? from[k] : k) * width + l + i];
    }
    for (; l < count; l++)
        for (int k = 0; k < rows; k++)
            columns[l * ld + k] = values[(from ? from[k] : k) * width + l];
}

void kmp_direction_lanes_put(const kmp_direction_lanes *lanes, int rows, const int *from, const double *values,
                             int lane, int count, double *columns)
{
    put_columns(lanes->width, rows, from, values + lane, count, columns);
}

/* -- all coordinates along closed motions ------------------------------------------------------------------ */

static bool some(int width, const double *row)
{
    int found = 0; /* no branch, so that the loop vectorises */
    for (int l = 0; l < width; l++)
        found |= row[l] != 0;
    return found;
}

/* Adds a column of a block to a lane, or to all of them times the numbers of `by`. A derivative that is not finite
 * counts only in lanes where these are not zero. */
static KMP_INTO_CLONES void add_times(int fours, const kmp_tangent *entry, const kmp_tangent *end, const double *d,
                                      const double *by, double *out)
{
    kmp_four sum[KMP_WIDE_FOURS];
    for (; entry < end; entry++) {
        const double value = d[entry->source];
        double *row = KMP_WIDE_ROW(fours, out, entry->row);
        if (fabs(value) <= DBL_MAX) {
            kmp_wide_load(fours, row, sum);
            kmp_wide_add(fours, value, by, sum);
            kmp_wide_store(fours, sum, row);
        } else
            for (int l = 0; l < KMP_FOUR * fours; l++)
                row[l] += by[l] != 0 ? value * by[l] : 0;
    }
}

/* out += block * x, where x is a unit change in rows of u, of the lane in `unit` (-1: of none). */
static KMP_INTO_CLONES void add_block(int fours, const kmp_direction_lanes *lanes, const kmp_tangents *tangents,
                                      kmp_tangent_block block, const double *d, const int *unit, const double *x,
                                      double *out)
{
    const int *start = tangents->column + tangents->first_column[block], *place = lanes->red->place;
    for (int c = 0; c < lanes->n; c++) {
        const kmp_tangent *entry = tangents->entry + start[c], *end = tangents->entry + start[c + 1];
        const double *by = KMP_WIDE_ROW(fours, x, c);
        const int lane = place[c] < 0 ? unit[-1 - place[c]] : -1;
        if (place[c] >= 0 && entry < end && some(KMP_FOUR * fours, by))
            add_times(fours, entry, end, d, by, out);
        for (; lane >= 0 && entry < end; entry++)
            KMP_WIDE_ROW(fours, out, entry->row)[lane] += d[entry->source];
    }
}

static KMP_CLONES void add_block_of_width(const kmp_direction_lanes *lanes, const kmp_tangents *tangents,
                                          kmp_tangent_block block, const double *d, const int *unit, const double *x,
                                          double *out)
{
    KMP_OF_WIDE(add_block, lanes->width, lanes, tangents, block, d, unit, x, out);
}

/* out = X du of unit changes of u in some lanes; the lane of each u, -1: none. */
static void spread_units(const kmp_direction_lanes *lanes, const int *u, int *unit, double *out)
{
    const ptrdiff_t width = lanes->width;
    memset(out, 0, (size_t)(lanes->n * width) * sizeof *out);
    for (int k = 0; k < lanes->p; k++)
        unit[k] = -1;
    for (int l = 0; l < width; l++) {
        if (u[l] < 0)
            continue;
        const int c = lanes->place[u[l]];
        unit[u[l]] = l;
        for (int e = lanes->x.start[c]; e < lanes->x.start[c + 1]; e++)
            out[lanes->x.at[e] * width + l] = lanes->red->x[lanes->x.from[e]];
    }
}

/* solved = -Jv^-1 rows, of all m given rows. */
static void solve_rows(kmp_direction_lanes *lanes, const double *rows)
{
    const ptrdiff_t width = lanes->width;
    const int *row = lanes->red->part->rows;
    for (int i = 0; i < lanes->r; i++)
        for (int l = 0; l < width; l++)
            lanes->right[i * width + l] = -rows[row[i] * width + l];
    kmp_block_solve_wide(lanes->red->block, lanes->width, lanes->right, lanes->solved);
}

static void add_dependent(const kmp_direction_lanes *lanes, double *out)
{
    const ptrdiff_t width = lanes->width;
    const int *v = lanes->red->part->v;
    for (int i = 0; i < lanes->r; i++)
        for (int l = 0; l < width; l++)
            out[v[i] * width + l] += lanes->solved[i * width + l];
}

void kmp_direction_lanes_follow(kmp_direction_lanes *lanes, const kmp_tangents *tangents, const double *d)
{
    const bool opens = some(lanes->m * lanes->width, lanes->h);
    int *unit = lanes->unit, *unit_rate = unit + lanes->p;
    bool moves = opens;
    for (int l = 0; l < lanes->width; l++)
        moves = moves || lanes->u[l] >= 0;
    spread_units(lanes, lanes->u, unit, lanes->dq);
    if (opens) {
        solve_rows(lanes, lanes->h);
        add_dependent(lanes, lanes->dq);
    }
    if (moves)
        add_block_of_width(lanes, tangents, KMP_RATE_Q, d, unit, lanes->dq, lanes->rate);
    spread_units(lanes, lanes->ud, unit_rate, lanes->dqd);
    if (some(lanes->m * lanes->width, lanes->rate)) {
        solve_rows(lanes, lanes->rate);
        add_dependent(lanes, lanes->dqd);
    }
    if (moves) {
        add_block_of_width(lanes, tangents, KMP_CURVE_Q, d, unit, lanes->dq, lanes->curve);
        add_block_of_width(lanes, tangents, KMP_R_Q, d, unit, lanes->dq, lanes->force);
    }
    add_block_of_width(lanes, tangents, KMP_CURVE_QD, d, unit_rate, lanes->dqd, lanes->curve);
    add_block_of_width(lanes, tangents, KMP_R_QD, d, unit_rate, lanes->dqd, lanes->force);
}

/* -- accelerations and multipliers ------------------------------------------------------------------------- */

/* Row c of udd, less the terms of its sum, over the pivot. */
static KMP_INTO_CLONES void eliminate(int fours, const kmp_terms *of, int c, const double *mr, double pivot,
                                      double *udd)
{
    double *own = KMP_WIDE_ROW(fours, udd, c);
    kmp_four sum[KMP_WIDE_FOURS];
    kmp_wide_load(fours, own, sum);
    subtract_terms(fours, of, c, mr, udd, sum);
    for (int f = 0; f < fours; f++)
        sum[f] /= KMP_FOUR_ALL(pivot);
    kmp_wide_store(fours, sum, own);
}

/* udd <- Mr^-1 udd. */
static KMP_INTO_CLONES void solve_mass(int fours, kmp_direction_lanes *lanes)
{
    const kmp_reduction *red = lanes->red;
    const double *mr = red->mr;
    const ptrdiff_t stride = red->zeros ? red->zeros->stride : lanes->p;
    for (int c = 0; c < lanes->p; c++)
        eliminate(fours, &lanes->lower, c, mr, mr[c * stride + c], lanes->udd);
    for (int c = lanes->p - 1; c >= 0; c--)
        eliminate(fours, &lanes->below, c, mr, mr[c * stride + c], lanes->udd);
}

/* udd and qdd from the force and, in `solved`, from the change of qdd in v at udd = 0, which is not zero with `bends`.
 */
static KMP_INTO_CLONES void accelerate(int fours, kmp_direction_lanes *lanes, bool bends)
{
    const kmp_reduction *red = lanes->red;
    const double *mass = red->eval->mass, *load = bends ? lanes->load : lanes->force;
    kmp_four sum[KMP_WIDE_FOURS];
    for (int i = 0; bends && i < lanes->n; i++) {
        kmp_wide_load(fours, KMP_WIDE_ROW(fours, lanes->force, i), sum);
        add_terms(fours, &lanes->mass_by, i, mass, lanes->solved, sum);
        kmp_wide_store(fours, sum, KMP_WIDE_ROW(fours, lanes->load, i));
    }
    for (int c = 0; c < lanes->p; c++) {
        kmp_wide_clear(fours, sum);
        add_terms(fours, &lanes->x, c, red->x, load, sum);
        kmp_wide_store_times(fours, -1, sum, KMP_WIDE_ROW(fours, lanes->udd, c));
    }
    solve_mass(fours, lanes);
    for (int c = 0; c < lanes->p; c++) {
        kmp_wide_load(fours, KMP_WIDE_ROW(fours, lanes->udd, c), sum);
        kmp_wide_store(fours, sum, KMP_WIDE_ROW(fours, lanes->qdd, red->part->u[lanes->order[c]]));
    }
    for (int i = 0; i < lanes->r; i++) {
        kmp_wide_load(fours, KMP_WIDE_ROW(fours, lanes->solved, i), sum);
        add_terms(fours, &lanes->moved, i, red->bvu, lanes->udd, sum);
        kmp_wide_store(fours, sum, KMP_WIDE_ROW(fours, lanes->qdd, red->part->v[i]));
    }
}

/* Rows of v of force + M qdd, in `right`. */
static KMP_INTO_CLONES void load_dependent(int fours, kmp_direction_lanes *lanes)
{
    const kmp_reduction *red = lanes->red;
    kmp_four sum[KMP_WIDE_FOURS];
    for (int i = 0; i < lanes->r; i++) {
        const int v = red->part->v[i];
        kmp_wide_load(fours, KMP_WIDE_ROW(fours, lanes->force, v), sum);
        add_terms(fours, &lanes->mass, v, red->eval->mass, lanes->qdd, sum);
        kmp_wide_store(fours, sum, KMP_WIDE_ROW(fours, lanes->right, i));
    }
}

static KMP_CLONES void respond_of_width(kmp_direction_lanes *lanes, bool bends, bool pulls)
{
    KMP_OF_WIDE(accelerate, lanes->width, lanes, bends);
    if (pulls)
        KMP_OF_WIDE(load_dependent, lanes->width, lanes);
}

static KMP_CLONES void solve_mass_of_width(kmp_direction_lanes *lanes)
{
    KMP_OF_WIDE(solve_mass, lanes->width, lanes);
}

void kmp_direction_lanes_solve(kmp_direction_lanes *lanes, bool bends, bool pulls)
{
    const size_t row = (size_t)lanes->width * sizeof(double);
    const int *rows = lanes->red->part->rows;
    bends = bends && lanes->r > 0;
    if (bends)
        solve_rows(lanes, lanes->curve);
    else
        memset(lanes->solved, 0, (size_t)lanes->r * row);
    respond_of_width(lanes, bends, pulls);
    if (!pulls)
        return;
    memset(lanes->lambda, 0, (size_t)lanes->m * row);
    kmp_block_solve_transposed_wide(lanes->red->block, lanes->width, lanes->right, lanes->solved);
    for (int i = 0; i < lanes->r; i++)
        memcpy(lanes->lambda + (ptrdiff_t)rows[i] * lanes->width, lanes->solved + (ptrdiff_t)i * lanes->width, row);
}

void kmp_direction_lanes_press(kmp_direction_lanes *lanes, int first, int count)
{
    const size_t row = (size_t)lanes->width * sizeof(double);
    memset(lanes->udd, 0, (size_t)lanes->p * row);
    for (int c = 0; c < lanes->p; c++)
        memcpy(lanes->udd + (ptrdiff_t)c * lanes->width, lanes->red->x + first + (ptrdiff_t)lanes->order[c] * lanes->n,
               (size_t)count * sizeof *lanes->udd);
    solve_mass_of_width(lanes);
}
