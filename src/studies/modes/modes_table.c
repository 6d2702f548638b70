/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes as tables. */
#include "output/result_table.h"
#include "studies/modes/modes_study.h"
#include <kempe/modes.h>

static void fill_modes(kempe_table *table, const void *result)
{
    const kempe_modes *m = result;
    const kmp_spectrum *s = &m->modes.spectrum;
    kmp_tabulate_columns(table, "index re[1/s] im[1/s] frequency[Hz] damping decay[s]");
    if (m->modes.z_re)
        kmp_tabulate_columns(table, "z.re z.im");
    kmp_tabulate_apart(table);
    for (int k = 0; k < 2 * m->modes.n; k++)
        kmp_tabulate_column(table, "", "%s.%s", k % 2 ? "im" : "re", m->system->model->motions[k / 2].name);
    for (int c = 0; c < s->count; c++) {
        double re = s->re[c], im = s->im[c];
        ptrdiff_t at = (ptrdiff_t)c * m->modes.n;
        kmp_tabulate_row(table);
        kmp_tabulate_cells(table, "%d %g %g %g %g %g", c, re, im, kmp_mode_frequency(re, im), kmp_mode_damping(re, im),
                           kmp_mode_time(re));
        if (m->modes.z_re)
            kmp_tabulate_cells(table, "%g %g", m->modes.z_re[c], m->modes.z_im[c]);
        for (int k = 0; k < m->modes.n; k++)
            kmp_tabulate_cells(table, "%g %g", m->modes.shown_re[k + at], m->modes.shown_im[k + at]);
    }
}

static void fill_sweep(kempe_table *table, const kempe_modes *m)
{
    const kmp_locus *l = &m->locus;
    const kmp_motion *motions = m->system->model->motions;
    const int n = m->modes.n;
    kmp_tabulate_column(table, kmp_quantity_unit_of(m->system, m->name), "%s", m->name);
    for (int k = 0; k < 2 * l->count; k++)
        kmp_tabulate_column(table, "1/s", "%s.%d", k % 2 ? "im" : "re", k / 2 + 1);
    for (int i = 0; i < n; i++)
        if (kmp_locus_has_load(l, n, i))
            kmp_tabulate_column(table, motions[i].rotation ? "N m" : "N", "load.%s", motions[i].name);
    for (int k = 0; k < l->reached; k++) {
        ptrdiff_t at = (ptrdiff_t)k * l->count;
        kmp_tabulate_row(table);
        kmp_tabulate_number(table, l->value[k]);
        for (int b = 0; b < l->count; b++)
            kmp_tabulate_cells(table, "%g %g", l->re[b + at], l->im[b + at]);
        for (int i = 0; i < n; i++)
            if (kmp_locus_has_load(l, n, i))
                kmp_tabulate_number(table, l->load[i + (ptrdiff_t)k * n]);
    }
}

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_modes *m = result;
    if (m->name)
        fill_sweep(table, m);
    else
        fill_modes(table, m);
}

static void fill_critical(kempe_table *table, const void *result)
{
    const kempe_modes *m = result;
    kmp_tabulate_column(table, m->name ? kmp_quantity_unit_of(m->system, m->name) : "", "value");
    kmp_tabulate_columns(table, "re[1/s] im[1/s] frequency[Hz] branch grows[words]");
    for (int k = 0; k < m->locus.critical_count; k++) {
        const kmp_critical *c = &m->locus.critical[k];
        kmp_tabulate_row(table);
        kmp_tabulate_cells(table, "%g %g %g %g %d %s", c->value, c->re, c->im, kmp_mode_frequency(c->re, c->im),
                           c->branch + 1, c->grows_above ? "above" : "below");
    }
}

static void fill_state(kempe_table *table, const void *result)
{
    const kempe_modes *m = result;
    kmp_tabulate_quantity(table, m->system, KMP_QUANTITY_Q);
    kmp_tabulate_quantity(table, m->system, KMP_QUANTITY_QD);
    kmp_tabulate_row(table);
    kmp_tabulate_values(table, m->system, KMP_QUANTITY_Q, m->q);
    kmp_tabulate_values(table, m->system, KMP_QUANTITY_QD, m->qd);
}

KMP_TABLES(kempe_modes, modes, modes->system->context, {"rows", fill_rows}, {"modes", fill_modes},
           {"critical", fill_critical}, {"state", fill_state})
