/* SPDX-License-Identifier: BSD-3-Clause */
/* Output of cycles: Hopf points, and the cycles of each branch, as text, JSON, tables and a picture. */
#include "analyses/limit_cycles/cycle_branch.h"
#include "analyses/limit_cycles/limit_cycles_study.h"
#include "analyses/parts/study_print.h"
#include "base/context.h"
#include "base/text.h"
#include "constraints/tolerances.h"
#include "model/data/body.h"
#include "output/plot.h"
#include "output/print.h"
#include "output/result_table.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { CELL = 12, MOST_ROWS = 12, INDENT = 4 };

static const double two_pi = 6.283185307179586476925286766559;

/* -- text ---------------------------------------------------------------------------------------------------- */

static void show_title(kmp_text *text, const kempe_limit_cycles *c)
{
    int hopf = 0, cycles = 0;
    for (int k = 0; k < c->locus.critical_count; k++)
        hopf += c->locus.critical[k].im > 0;
    kmp_text title = {0};
    for (int b = 0; b < c->branches; b++)
        cycles += c->branch[b].count;
    kmp_print_title(&title, c->system->model, kmp_outcome_of(c->status));
    kmp_text_printf(&title, "%s from %.6g to ", c->name, kmp_limit_cycles_shown(c).factor * c->from);
    kmp_print_value_of(&title, c->system, c->name, c->to);
    if (c->settle > 0)
        kmp_text_printf(&title, ": %d simulations of %g s", cycles, c->settle);
    else if (hopf == 0)
        kmp_text_put(&title, ": no Hopf point, so that no branch of limit cycles begins here");
    else
        kmp_text_printf(&title, ": %d Hopf point%s, %d branch%s of %d limit cycles", hopf, hopf == 1 ? "" : "s",
                        c->branches, c->branches == 1 ? "" : "es", cycles);
    kmp_print_answer(text, &title, kmp_outcome_of(c->status), c->warnings, "  Stopped: ", c->reason);
}

static const char *held_name(const kempe_limit_cycles *c, int k)
{
    return kmp_model_motion(c->system->model, c->held_motion[k])->name;
}

/* Points at which the stability changes: of equilibria, and of cycles. */
static void show_points(kmp_text *text, const kempe_limit_cycles *c)
{
    for (int k = 0; k < c->locus.critical_count; k++) {
        const kmp_critical *at = &c->locus.critical[k];
        if (at->im <= 0)
            continue;
        kmp_text_printf(text, "  Hopf point at %s = ", c->name);
        kmp_print_value_of(text, c->system, c->name, at->value);
        kmp_text_printf(text, ", %.6g Hz: the equilibrium is unstable %s it\n", at->im / two_pi,
                        at->grows_above ? "above" : "below");
    }
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++) {
            const kmp_cycle *x = c->branch[b].cycle[k];
            if (x->word == KMP_CYCLE_REGULAR || x->word == KMP_CYCLE_HOPF || x->word == KMP_CYCLE_REST)
                continue;
            kmp_text_printf(text, "  %s at %s = ", kmp_cycle_text(x), c->name);
            kmp_print_value_of(text, c->system, c->name, x->value);
            kmp_text_printf(text, ", branch %d\n", b + 1);
        }
}

/* A column of values: the head 'load.shaft, N m' and the factor of its unit. */
typedef struct column {
    const char *before, *name, *unit;
    double factor;
} column;

/* The swept value. */
static column first_column(const kempe_limit_cycles *c)
{
    const kmp_shown as = kmp_limit_cycles_shown(c);
    return (column){"", c->name, as.unit, as.factor};
}

/* The columns behind the multiplier: loads, then outputs. */

static column column_of(const kempe_limit_cycles *c, int k)
{
    const bool load = k < c->held;
    const kempe_context *context = c->system->context;
    const char *unit = load ? kmp_cycles_load_unit(c, k) : kmp_print_unknown(context, c->unit[k - c->held]);
    const kmp_shown as = kmp_shown_as(context, unit);
    return (column){load ? "load." : "", load ? held_name(c, k) : c->output[k - c->held], as.unit, as.factor};
}

static int width_of(const column *of)
{
    int length = (int)(strlen(of->before) + strlen(of->name) + (*of->unit ? strlen(", ") + strlen(of->unit) : 0));
    return length > CELL ? length : CELL;
}

static void put_head(kmp_text *text, const column *of)
{
    kmp_text head = {0};
    kmp_text_printf(&head, "%s%s%s%s", of->before, of->name, *of->unit ? ", " : "", of->unit);
    kmp_text_printf(text, "  %*s", width_of(of), head.s ? head.s : "");
    kmp_text_free_part(text, &head);
}

/* As many of them as a line has room for, and one at least. */
static int shown_columns(const kempe_limit_cycles *c)
{
    const column first = first_column(c);
    int room = KMP_PRINT_LINE - 48 - width_of(&first);
    for (int k = 0; k < c->held + c->outputs; k++) {
        const column of = column_of(c, k);
        room -= 2 + width_of(&of);
        if (room < 0 && k > 0)
            return k;
    }
    return c->held + c->outputs;
}

static void show_cycle(kmp_text *text, const kempe_limit_cycles *c, const kmp_cycle *x, int columns)
{
    bool hopf = x->word == KMP_CYCLE_HOPF;
    const column first = first_column(c);
    kmp_print_cells(text, "  %-9s  %*.6g  %12.6g  %-9s", kmp_cycle_text(x), width_of(&first), first.factor * x->value,
                    x->period, hopf ? "" : kmp_cycle_stability_text(x));
    if (hopf)
        kmp_text_printf(text, "  %10s", "");
    else
        kmp_print_cells(text, "  %10.6f", x->multipliers > 0 ? hypot(x->re[0], x->im[0]) : NAN);
    for (int k = 0; k < columns; k++) {
        const column of = column_of(c, k);
        kmp_print_cells(text, "  %*.6g", width_of(&of),
                        of.factor * (k < c->held ? x->load[k] : kmp_cycle_amplitude(x, k - c->held)));
    }
    kmp_text_put(text, "\n");
}

/* True for special points, the ends of the branch, and MOST_ROWS of the others, evenly chosen. */
static bool is_shown(const kmp_cycle_branch *b, int k, bool all)
{
    return all || b->count <= MOST_ROWS || b->cycle[k]->word != KMP_CYCLE_REGULAR || k == 0 || k == b->count - 1 ||
           k * (MOST_ROWS - 1) / (b->count - 1) != (k - 1) * (MOST_ROWS - 1) / (b->count - 1);
}

static void show_branch(kmp_text *text, const kempe_limit_cycles *c, int branch, bool all)
{
    const kmp_cycle_branch *b = &c->branch[branch];
    const int columns = shown_columns(c);
    kmp_text head = {0};
    kmp_text_printf(&head, c->settle > 0 ? "Branch %d: %d simulations; %s" : "Branch %d: %d cycles; %s", branch + 1,
                    b->count, b->end ? b->end : "interrupted");
    kmp_text_put(text, "\n");
    kmp_print_wrapped(text, "", INDENT, head.s ? head.s : "");
    kmp_text_free_part(text, &head);
    const column first = first_column(c);
    kmp_text_printf(text, "  %-9s", "");
    put_head(text, &first);
    kmp_text_printf(text, "  %12s  %-9s  %10s", "period, s", "stability", "multiplier");
    for (int k = 0; k < columns; k++) {
        const column of = column_of(c, k);
        put_head(text, &of);
    }
    kmp_text_put(text, "\n");
    for (int k = 0; k < b->count; k++)
        if (is_shown(b, k, all))
            show_cycle(text, c, b->cycle[k], columns);
}

static void show_parts(kmp_text *text, const kempe_limit_cycles *c, bool all)
{
    kmp_text line = {0};
    show_title(text, c);
    show_points(text, c);
    for (int k = 0; k < c->held; k++)
        kmp_text_printf(&line, "%s'%s'", k ? ", " : "", held_name(c, k));
    if (c->held > 0)
        kmp_text_printf(
            text, "  A load holds the speed of %s, because no other force determines it; the mean load is shown\n",
            line.s);
    kmp_text_free_part(text, &line);
    for (int b = 0; b < c->branches; b++)
        show_branch(text, c, b, all);
    if (c->settle > 0)
        kmp_text_printf(text,
                        "\nMotions at the end of each simulation; undecided: amplitudes still change by more than %g\n",
                        KMP_CYCLE_SETTLED);
    else if (c->branches > 0)
        kmp_text_put(text, "\nOutputs: amplitudes, half the range over a period. Multiplier: the largest Floquet "
                           "multiplier\nwithout the multiplier 1 of the motion along the cycle; stable below 1\n");
    if (c->branches > 0)
        kmp_text_printf(text, "More: %s-o FILE.csv, --svg FILE\n", all ? "" : "--all (every cycle), ");
}

/* -- JSON ---------------------------------------------------------------------------------------------------- */

static void json_cycle(kmp_json *j, const kempe_limit_cycles *c, const kmp_cycle *x)
{
    bool hopf = x->word == KMP_CYCLE_HOPF;
    kmp_json_put(j, "{ value %g period %g point %s", x->value, x->period, x->word ? kmp_cycle_text(x) : NULL);
    for (int k = 0; k < c->held; k++)
        kmp_json_put(j, k == 0 ? "loads { %s %g" : "%s %g", held_name(c, k), x->load[k]);
    if (c->held > 0)
        kmp_json_end(j);
    if (!hopf) {
        kmp_json_put(j, "stability %s along %g residual %g", kmp_cycle_stability_text(x), x->along, x->residual);
        kmp_print_pairs(j, "multipliers", x->multipliers, x->re, x->im);
        kmp_json_object(j, "outputs");
        for (int k = 0; k < c->outputs; k++)
            kmp_json_put(j, "%s { amplitude %g max %g min %g }", c->output[k], kmp_cycle_amplitude(x, k), x->high[k],
                         x->low[k]);
        kmp_json_end(j);
    }
    kmp_json_end(j);
}

static void json(kmp_text *text, const void *result)
{
    const kempe_limit_cycles *c = result;
    kmp_json j = kmp_print_head(text, c->system, kmp_outcome_of(c->status), c->reason, 0, c->warnings);
    kmp_json_put(&j, "parameter %s from %g to %g cpu_s %g hopf [", c->name, c->from, c->to, c->cpu_s);
    for (int k = 0; k < c->locus.critical_count; k++) {
        const kmp_critical *at = &c->locus.critical[k];
        if (at->im > 0)
            kmp_json_put(&j, "{ value %g frequency %g grows %s branch %d }", at->value, at->im / two_pi,
                         at->grows_above ? "above" : "below", c->branch_of[k]);
    }
    kmp_json_put(&j, "] branches [");
    for (int b = 0; b < c->branches; b++) {
        kmp_json_put(&j, "{ end %s cycles [", c->branch[b].end);
        for (int k = 0; k < c->branch[b].count; k++)
            json_cycle(&j, c, c->branch[b].cycle[k]);
        kmp_json_put(&j, "] }");
    }
    kmp_json_put(&j, "] }");
}

KMP_PRINT_FULL(kempe_limit_cycles, cycles, cycles->system->context, json, show_parts)

static void add_parameter(kempe_table *table, const kempe_limit_cycles *c)
{
    kmp_tabulate_value(table, c->system, "", c->name);
}

static void put_row(kempe_table *table, const kempe_limit_cycles *c, int branch, const kmp_cycle *x)
{
    bool hopf = x->word == KMP_CYCLE_HOPF;
    KMP_TABULATE(table, "%d %g %g %s %s %g %g %g", branch, x->value, x->period, kmp_cycle_text(x),
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
                            kmp_model_motion(c->system->model, c->held_motion[k])->name);
    for (int k = 0; k < c->outputs; k++) {
        const char *unit = kmp_print_unknown(c->system->context, c->unit[k]);
        kmp_tabulate_column(table, unit, "%s.amplitude", c->output[k]);
        kmp_tabulate_column(table, unit, "%s.max", c->output[k]);
        kmp_tabulate_column(table, unit, "%s.min", c->output[k]);
    }
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++)
            put_row(table, c, b + 1, c->branch[b].cycle[k]);
}

static void fill_multipliers(kempe_table *table, const void *result)
{
    const kempe_limit_cycles *c = result;
    int row = 0;
    kmp_tabulate_columns(table, "cycle re im");
    kmp_tabulate_apart(table);
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++) {
            const kmp_cycle *x = c->branch[b].cycle[k];
            row++;
            for (int i = 0; i < x->multipliers; i++)
                KMP_TABULATE(table, "%d %g %g", row, x->re[i], x->im[i]);
        }
}

static void fill_states(kempe_table *table, const void *result)
{
    const kempe_limit_cycles *c = result;
    add_parameter(table, c);
    kmp_tabulate_columns(table, "period[s]");
    for (int i = 0; c->flow && i < c->flow->size; i++) {
        const kmp_flow_entry *e = &c->flow->entry[i];
        kmp_quantity quantity = e->kind == KMP_FLOW_RATE ? KMP_QUANTITY_QD : KMP_QUANTITY_Q;
        const char *unit = e->kind == KMP_FLOW_STATE ? "" : kmp_quantity_unit(c->system, quantity, e->motion);
        kmp_tabulate_column(table, kmp_print_unknown(c->system->context, unit), "%s.%s", kmp_flow_kinds[e->kind],
                            kmp_flow_name(c->system->model, e));
    }
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++) {
            const kmp_cycle *x = c->branch[b].cycle[k];
            KMP_TABULATE(table, "%g %g", x->value, x->period);
            if (c->flow) /* there are no cycles without it */
                kmp_tabulate_numbers(table, c->flow->size, x->x);
        }
}

static void fill_equilibria(kempe_table *table, const void *result)
{
    const kempe_limit_cycles *c = result;
    add_parameter(table, c);
    kmp_tabulate_columns(table, "growth[1/s]");
    for (int k = 0; k < c->locus.reached; k++)
        KMP_TABULATE(table, "%g %g", c->locus.value[k], kmp_limit_cycles_growth(c, k));
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
        KMP_TABULATE(table, "%g %g %d", at->value, at->im / (2 * acos(-1)), c->branch_of[k]);
    }
}

KMP_TABLES(kempe_limit_cycles, cycles, cycles->system->context, {"rows", fill_rows}, {"multipliers", fill_multipliers},
           {"states", fill_states}, {"equilibria", fill_equilibria}, {"critical", fill_critical})

/* -- picture ------------------------------------------------------------------------------------------------ */

/* The bifurcation diagram: amplitudes over the parameter, a plot for each output. Stable parts are solid, all others
 * dashed; an equilibrium has no amplitude. */

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

/* The value between two of the locus at which the equilibrium loses its stability; the middle where it is not a
 * Hopf point. */
static double change_between(const kmp_locus *l, double a, double b)
{
    for (int k = 0; k < l->critical_count; k++)
        if ((l->critical[k].value - a) * (l->critical[k].value - b) <= 0)
            return l->critical[k].value;
    return (a + b) / 2;
}

static void put_plot(kmp_text *text, const kempe_limit_cycles *c, int output, int place)
{
    const kmp_shown by = kmp_limit_cycles_shown(c);
    const column as = output < c->outputs ? column_of(c, c->held + output) : (column){"", "amplitude", "", 1};
    drawing d = {c, kmp_plot_inside(text, 0, HEIGHT * place, WIDTH, HEIGHT), output, by.factor, as.factor};
    kmp_plot_reach(&d.plot, by.factor * c->from, 0);
    kmp_plot_reach(&d.plot, by.factor * c->to, 0);
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++)
            kmp_plot_reach(&d.plot, by.factor * c->branch[b].cycle[k]->value, height(&d, c->branch[b].cycle[k]));
    d.plot.axis[0].name = c->name;
    d.plot.axis[0].unit = by.unit;
    d.plot.axis[1].name = as.name;
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
