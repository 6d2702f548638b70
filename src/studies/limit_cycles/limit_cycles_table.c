/* SPDX-License-Identifier: BSD-3-Clause */
/* Limit cycles as tables. */
#include "output/result_table.h"
#include "studies/limit_cycles/limit_cycles_study.h"
#include <math.h>

static void add_parameter(kempe_table *table, const kempe_limit_cycles *c)
{
    kmp_tabulate_column(table, kmp_quantity_unit_of(c->system, c->name), "%s", c->name);
}

/* Calls `put` for each cycle, branch by branch. */
static void each_cycle(kempe_table *table, const kempe_limit_cycles *c,
                       void (*put)(kempe_table *table, const kempe_limit_cycles *c, int branch, int row,
                                   const kmp_cycle *cycle))
{
    int row = 0;
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++)
            put(table, c, b + 1, ++row, c->branch[b].cycle[k]);
}

static void put_row(kempe_table *table, const kempe_limit_cycles *c, int branch, int row, const kmp_cycle *x)
{
    bool hopf = x->word == KMP_CYCLE_HOPF;
    (void)row;
    kmp_tabulate_row(table);
    kmp_tabulate_cells(table, "%d %g %g %s %s %g %g %g", branch, x->value, x->period, kmp_cycle_text(x),
                       hopf ? "" : kmp_cycle_stability_text(x), x->multipliers > 0 ? hypot(x->re[0], x->im[0]) : NAN,
                       hopf ? NAN : x->along, hopf ? NAN : x->residual);
    if (c->held > 0)
        kmp_tabulate_numbers(table, c->held, x->load);
    for (int k = 0; k < c->outputs; k++)
        kmp_tabulate_cells(table, "%g %g %g", kmp_cycle_amplitude(x, k), hopf ? NAN : x->high[k],
                           hopf ? NAN : x->low[k]);
}

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_limit_cycles *c = result;
    kmp_tabulate_columns(table, "branch");
    add_parameter(table, c);
    kmp_tabulate_columns(table, "period[s] point[words] stability[words] multiplier along residual");
    for (int k = 0; k < c->held; k++)
        kmp_tabulate_column(table, kmp_cycles_load_unit(c, k), "load.%s",
                            c->system->model->motions[c->held_motion[k]].name);
    for (int k = 0; k < c->outputs; k++) {
        kmp_tabulate_column(table, c->unit[k], "%s.amplitude", c->output[k]);
        kmp_tabulate_column(table, c->unit[k], "%s.max", c->output[k]);
        kmp_tabulate_column(table, c->unit[k], "%s.min", c->output[k]);
    }
    each_cycle(table, c, put_row);
}

static void put_multipliers(kempe_table *table, const kempe_limit_cycles *c, int branch, int row, const kmp_cycle *x)
{
    (void)c, (void)branch;
    for (int k = 0; k < x->multipliers; k++) {
        kmp_tabulate_row(table);
        kmp_tabulate_cells(table, "%d %g %g", row, x->re[k], x->im[k]);
    }
}

static void fill_multipliers(kempe_table *table, const void *result)
{
    kmp_tabulate_columns(table, "cycle re im");
    kmp_tabulate_apart(table);
    each_cycle(table, result, put_multipliers);
}

static void put_state(kempe_table *table, const kempe_limit_cycles *c, int branch, int row, const kmp_cycle *x)
{
    (void)branch, (void)row;
    kmp_tabulate_row(table);
    kmp_tabulate_cells(table, "%g %g", x->value, x->period);
    if (c->flow) /* there are no cycles without it */
        kmp_tabulate_numbers(table, c->flow->size, x->x);
}

static void fill_states(kempe_table *table, const void *result)
{
    const kempe_limit_cycles *c = result;
    add_parameter(table, c);
    kmp_tabulate_columns(table, "period[s]");
    for (int i = 0; c->flow && i < c->flow->size; i++) {
        const kmp_flow_entry *e = &c->flow->entry[i];
        static const char *const prefix[] = {"q", "qd", "state"};
        const kmp_state *state = kmp_state_of(c->system->model, e->motion);
        kmp_quantity quantity = e->kind == KMP_FLOW_RATE ? KMP_QUANTITY_QD : KMP_QUANTITY_Q;
        kmp_tabulate_column(table, state ? "" : kmp_quantity_unit(c->system, quantity, e->motion), "%s.%s",
                            prefix[e->kind], state ? state->name : c->system->model->motions[e->motion].name);
    }
    each_cycle(table, c, put_state);
}

static void fill_equilibria(kempe_table *table, const void *result)
{
    const kempe_limit_cycles *c = result;
    add_parameter(table, c);
    kmp_tabulate_columns(table, "growth[1/s]");
    for (int k = 0; k < c->locus.reached; k++) {
        kmp_tabulate_row(table);
        kmp_tabulate_cells(table, "%g %g", c->locus.value[k], kmp_limit_cycles_growth(c, k));
    }
}

static void fill_critical(kempe_table *table, const void *result)
{
    const kempe_limit_cycles *c = result;
    add_parameter(table, c);
    kmp_tabulate_columns(table, "frequency[Hz] branch");
    for (int k = 0; k < c->locus.critical_count; k++) {
        const kmp_critical *at = &c->locus.critical[k];
        if (!(at->im > 0))
            continue;
        kmp_tabulate_row(table);
        kmp_tabulate_cells(table, "%g %g %d", at->value, at->im / (2 * acos(-1)), c->branch_of[k]);
    }
}

KMP_TABLES(kempe_limit_cycles, cycles, cycles->system->context, {"rows", fill_rows}, {"multipliers", fill_multipliers},
           {"states", fill_states}, {"equilibria", fill_equilibria}, {"critical", fill_critical})
