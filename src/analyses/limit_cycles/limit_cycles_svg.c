/* SPDX-License-Identifier: BSD-3-Clause */
/* The bifurcation diagram: amplitudes over the parameter, a plot for each output. Stable parts are solid, all others
 * dashed; an equilibrium has no amplitude. */
#include "analyses/limit_cycles/limit_cycles_svg.h"
#include "analyses/limit_cycles/limit_cycles_study.h"
#include "output/plot.h"
#include <math.h>

enum { WIDTH = 640, HEIGHT = 400, MOST_PLOTS = 8 };

typedef struct drawing {
    const kempe_limit_cycles *c;
    kmp_plot plot;
    int output;
    double factor;        /* of the parameter */
    double output_factor; /* of the output */
} drawing;

static double height(const drawing *d, const kmp_cycle *x)
{
    return d->output_factor * kmp_cycle_amplitude(x, d->output);
}

bool kmp_cycles_stable_between(const kmp_cycle *a, const kmp_cycle *b)
{
    bool one = a->stability == KMP_CYCLE_STABLE || b->stability == KMP_CYCLE_STABLE;
    return one && (a->stability == KMP_CYCLE_STABLE || a->word != KMP_CYCLE_REGULAR) &&
           (b->stability == KMP_CYCLE_STABLE || b->word != KMP_CYCLE_REGULAR);
}

static void put_branch(drawing *d, const kmp_cycle_branch *b, const char *colour)
{
    int from = 0;
    for (int k = 1; k < b->count; k++) {
        bool stable = kmp_cycles_stable_between(b->cycle[k - 1], b->cycle[k]);
        if (k + 1 < b->count && kmp_cycles_stable_between(b->cycle[k], b->cycle[k + 1]) == stable)
            continue;
        kmp_curve_begin(&d->plot, stable ? "curve" : "dashed", colour);
        for (int i = from; i <= k; i++)
            kmp_curve_to(&d->plot, d->factor * b->cycle[i]->value, height(d, b->cycle[i]));
        kmp_curve_end(&d->plot);
        from = k;
    }
    for (int k = 0; k < b->count; k++)
        if (b->cycle[k]->word != KMP_CYCLE_REGULAR)
            kmp_plot_dot(&d->plot, d->factor * b->cycle[k]->value, height(d, b->cycle[k]), colour);
}

/* The value between two of the locus at which the equilibrium loses its stability; the middle where it is no Hopf
 * point. */
static double change_between(const kmp_locus *l, double a, double b)
{
    for (int k = 0; k < l->critical_count; k++)
        if ((l->critical[k].value - a) * (l->critical[k].value - b) <= 0)
            return l->critical[k].value;
    return (a + b) / 2;
}

static void put_plot(kmp_text *text, const kempe_limit_cycles *c, int output, int place)
{
    kmp_shown by = kmp_limit_cycles_shown(c),
              as = kmp_shown_as(c->system->context, output < c->outputs ? c->unit[output] : "");
    drawing d = {c, kmp_plot_inside(text, 0, HEIGHT * place, WIDTH, HEIGHT), output, by.factor, as.factor};
    kmp_plot_reach(&d.plot, by.factor * c->from, 0);
    kmp_plot_reach(&d.plot, by.factor * c->to, 0);
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++)
            kmp_plot_reach(&d.plot, by.factor * c->branch[b].cycle[k]->value, height(&d, c->branch[b].cycle[k]));
    d.plot.axis[0].name = c->name;
    d.plot.axis[0].unit = by.unit;
    d.plot.axis[1].name = output < c->outputs ? c->output[output] : "amplitude";
    d.plot.axis[1].unit = as.unit;
    kmp_plot_begin(&d.plot, "Amplitude of limit cycles: solid stable, dashed unstable");
    /* The equilibria, dashed where they are unstable. */
    const kmp_locus *l = &d.c->locus;
    for (int k = 0; k + 1 < l->reached; k++) {
        bool grows[] = {kmp_limit_cycles_growth(d.c, k) > 0, kmp_limit_cycles_growth(d.c, k + 1) > 0};
        double ends[] = {l->value[k], change_between(l, l->value[k], l->value[k + 1]), l->value[k + 1]};
        for (int half = 0; half < 2; half++) {
            kmp_curve_begin(&d.plot, grows[half] ? "dashed" : "curve", "#4a545a");
            kmp_curve_to(&d.plot, d.factor * ends[half], 0);
            kmp_curve_to(&d.plot, d.factor * ends[half + 1], 0);
            kmp_curve_end(&d.plot);
        }
    }
    for (int b = 0; b < c->branches; b++)
        put_branch(&d, &c->branch[b], kmp_plot_colour(b));
    kmp_plot_end(&d.plot);
}

kempe_status kempe_limit_cycles_write_picture(const kempe_limit_cycles *cycles, const char *path)
{
    KMP_WANTED(NULL, cycles, "cycles");
    KMP_WANTED(cycles->system->context, path, "path");
    int shown[MOST_PLOTS], count = 0, columns = cycles->outputs;
    kmp_text text = {0};
    kmp_context_clear(cycles->system->context);
    for (int o = 0; o < columns && count < MOST_PLOTS; o++) {
        bool periodic = false; /* at least in one cycle */
        for (int b = 0; b < cycles->branches; b++)
            for (int k = 1; k < cycles->branch[b].count; k++)
                periodic = periodic || isfinite(cycles->branch[b].cycle[k]->high[o]);
        if (periodic)
            shown[count++] = o;
    }
    kmp_picture_begin(&text, WIDTH, HEIGHT * (count > 0 ? count : 1), "");
    for (int k = 0; k < count; k++)
        put_plot(&text, cycles, shown[k], k);
    if (count == 0)
        put_plot(&text, cycles, 0, 0);
    kmp_picture_end(&text);
    return kmp_picture_write(cycles->system->context, path, &text);
}
