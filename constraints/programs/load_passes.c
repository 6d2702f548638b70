/* SPDX-License-Identifier: BSD-3-Clause */
/* Steps are not halved, and begin nowhere else: states that do not settle so are left to load_multipliers.c. */
#include "constraints/programs/load_passes.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST_PASSES = 12 };

int kmp_load_place(const kmp_partition *part, int row)
{
    for (int i = 0; i < part->r; i++)
        if (part->rows[i] == row)
            return i;
    return -1;
}

int kmp_load_rows(const kempe_system *s, const kmp_partition *part, int *row)
{
    int count = 0;
    for (int j = 0; j < s->load_row_count; j++)
        if (kmp_load_place(part, s->load_rows[j]) >= 0)
            row[count++] = s->load_rows[j];
    return count;
}

bool kmp_load_passes_init(kmp_load_passes *x, kmp_arena *arena, const kempe_system *s, const kmp_partition *part,
                          size_t width)
{
    *x = (kmp_load_passes){.width = width, .n = s->n, .m = s->m, .scale = s->scale, .weight = s->row_scale};
    x->row = KMP_ARENA_NEW(arena, int, s->load_row_count + 1);
    x->nu = kmp_arena_aligned(arena, width * (size_t)s->m);
    if (!x->row || !x->nu)
        return false;
    x->loads = kmp_load_rows(s, part, x->row);
    return true;
}

void kmp_load_begin(kmp_load_passes *x, const double *nu)
{
    for (int r = 0; nu && r < x->m; r++)
        for (size_t l = 0; l < x->width; l++)
            x->nu[(size_t)r * x->width + l] = nu[r];
    for (size_t l = 0; l < x->width; l++) {
        x->settled[l] = false;
        x->energy[l] = INFINITY;
    }
    x->pass = 0;
}

static double scale_of(const kmp_load_passes *x, const double *scale, size_t k, size_t l)
{
    return scale[x->by_state ? k * x->width + l : k];
}

/* True if the multipliers of state l satisfy the equations up to rounding. */
static bool is_settled(kmp_load_passes *x, const double *out, size_t l)
{
    const size_t w = x->width, n = (size_t)x->n;
    double size = 0, most = 0, before = x->energy[l];
    for (size_t i = 0; i < n; i++)
        size = fmax(size, fabs(out[i * w + l]) * scale_of(x, x->scale, i, l));
    for (size_t j = 0; j < (size_t)x->loads; j++) {
        const size_t row = (size_t)x->row[j];
        const double residual = out[(n + j) * w + l], nu = x->nu[row * w + l], weight = scale_of(x, x->weight, row, l);
        size = fmax(size, fmax(fabs(nu), fabs(nu + residual)) * weight);
        most = fabs(residual) <= DBL_MAX ? fmax(most, fabs(residual) * weight) : INFINITY;
    }
    x->energy[l] = most;
    return most <= KMP_LOAD_ROUNDING * size || (most <= KMP_LOAD_ROUNDED * size && !(most < 0.5 * before));
}

/* Takes the outputs of a pass at the present multipliers, of which states without a solution get others. True: a
 * further pass is needed. */
static bool pass(kmp_load_passes *x, const double *out)
{
    const size_t w = x->width, loads = (size_t)x->loads;
    const bool last = x->pass++ >= MOST_PASSES;
    bool all = true;
    for (size_t l = 0; l < w; l++) {
        x->settled[l] = x->settled[l] || is_settled(x, out, l);
        all = all && x->settled[l];
        for (size_t j = 0; j < loads && !x->settled[l] && !last; j++)
            x->nu[(size_t)x->row[j] * w + l] += out[((size_t)x->n + loads + j) * w + l];
    }
    return !all && !last;
}

static bool all_settled(const kmp_load_passes *x)
{
    bool all = true;
    for (size_t l = 0; l < x->width; l++)
        all = all && x->settled[l];
    return all;
}

bool kmp_load_settle_one(kmp_load_passes *x, kmp_machine *machine)
{
    (void)kmp_machine_run(machine, KMP_LOADS_APART);
    do
        kmp_machine_set(machine, KMP_IN_LAMBDA, x->nu);
    while (pass(x, kmp_machine_run(machine, KMP_LOADS_PASS)));
    return all_settled(x);
}

bool kmp_load_settle_lanes(kmp_load_passes *x, kmp_lanes *lanes)
{
    (void)kmp_lanes_run(lanes, KMP_LOADS_APART);
    do
        kmp_lanes_set(lanes, KMP_IN_LAMBDA, x->nu);
    while (pass(x, kmp_lanes_run(lanes, KMP_LOADS_PASS)));
    return all_settled(x);
}

kmp_counts kmp_load_count(const kmp_program *p, int last)
{
    kmp_counts count = kmp_program_count(p, KMP_LOADS_APART, last);
    for (int i = p->code[KMP_LOADS_PASS]; i < p->code[KMP_LOADS_PASS + 1]; i++)
        kmp_counts_take(&count, &p->instruction[i], 1);
    return count;
}
