/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/programs/load_newton.h"
#include "constraints/programs/load_passes.h"
#include "dynamics/motion.h"
#include <string.h>

bool kmp_load_newton_init(kmp_load_newton *x, kmp_program_writer *w, const kmp_partition *part)
{
    const kempe_system *s = w->s;
    const int most = s->load_row_count;
    *x = (kmp_load_newton){.at = KMP_ARENA_NEW(&w->arena, int, most + 1),
                           .matrix = KMP_ARENA_NEW(&w->arena, kmp_ref, most * most)};
    if (!KMP_ARENA_EACH(&w->arena, kmp_ref, most, &x->nu, &x->residual, &x->step) || !x->at || !x->matrix)
        return false;
    for (int j = 0; j < most; j++) {
        const int row = s->load_rows[j], at = kmp_load_place(part, row);
        if (at < 0) {
            kmp_writer_replace(w, KMP_IN_LAMBDA, row, KMP_ZERO);
            continue;
        }
        x->nu[x->count] = kmp_input(w->g, KMP_IN_LAMBDA, (uint32_t)row);
        x->at[x->count++] = at;
    }
    return true;
}

void kmp_load_newton_take(kmp_load_newton *x, kmp_program_writer *w, const kmp_partition *part, int j,
                          const kmp_ref *influence, kmp_ref constant)
{
    const kmp_pattern *load = &w->s->load_jacobian;
    kmp_ref value = constant, *row = x->matrix + j * x->count;
    for (int i = 0; i < w->s->n; i++)
        kmp_writer_add_product(w->g, &value, influence[i], w->bias[i]);
    x->residual[j] = kmp_sub(w->g, value, x->nu[j]);
    x->step[j] = kmp_neg(x->residual[j]);
    for (int l = 0; l < x->count; l++) {
        row[l] = j == l ? kmp_neg(KMP_ONE) : KMP_ZERO;
        for (int e = 0; e < load->count; e++)
            if (load->col[e] == part->rows[x->at[l]])
                kmp_writer_add_product(w->g, &row[l], influence[load->row[e]], w->load[e]);
    }
}

/* In the order of the rows: the diagonal of dLambda/dnu - 1 is far from zero wherever the multipliers are determined.
 */
void kmp_load_newton_solve(kmp_load_newton *x, kmp_graph *g)
{
    const int count = x->count;
    kmp_ref *a = x->matrix, *b = x->step;
    for (int j = 0; j < count; j++) {
        kmp_ref inverse = kmp_div(g, KMP_ONE, a[j * count + j]);
        for (int i = j + 1; i < count; i++) {
            kmp_ref l = kmp_neg(kmp_mul(g, a[i * count + j], inverse));
            for (int c = j + 1; c < count; c++)
                kmp_writer_add_product(g, &a[i * count + c], l, a[j * count + c]);
            kmp_writer_add_product(g, &b[i], l, b[j]);
        }
    }
    for (int i = count; i-- > 0;) {
        for (int c = i + 1; c < count; c++)
            b[i] = kmp_sub(g, b[i], kmp_mul(g, a[i * count + c], b[c]));
        b[i] = kmp_div(g, b[i], a[i * count + i]);
    }
}

void kmp_load_newton_put(const kmp_load_newton *x, kmp_program_writer *w)
{
    kmp_writer_put(w, w->s->n, w->bias);
    kmp_writer_put(w, x->count, x->residual);
    kmp_writer_put(w, x->count, x->step);
}

int kmp_load_newton_outputs(const kmp_load_newton *x, const kmp_program_writer *w)
{
    return w->s->n + 2 * x->count + (int)kmp_graph_count(w->g);
}

bool kmp_load_newton_separate(kmp_program_writer *w)
{
    const int pass = w->stages - 2, count = w->count[pass] + w->count[pass + 1];
    kmp_ref *from = w->to - count, *free_of_nu = KMP_ARENA_NEW(&w->arena, kmp_ref, kmp_graph_count(w->g));
    int found;
    if (!free_of_nu || !kmp_list_independent(w->g, KMP_IN_LAMBDA, count, from, free_of_nu, &found))
        return false;
    memmove(from + found, from, (size_t)count * sizeof *from);
    memcpy(from, free_of_nu, (size_t)found * sizeof *from);
    w->count[pass - 1] = found;
    w->group[pass] += found;
    w->group[pass + 1] += found;
    w->to += found;
    return true;
}
