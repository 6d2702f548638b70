/* SPDX-License-Identifier: BSD-3-Clause */
/* A table of contacts as text, JSON, CSV and a picture. */
#include "analyses/parts/study_print.h"
#include "base/context.h"
#include "model/data/body.h"
#include "model/data/wheels.h"
#include "output/plot.h"
#include "output/print.h"
#include "output/result_table.h"
#include "rail/model/wheel_words.h"
#include "rail/wheel_contact/contact_pressure.h"
#include "rail/wheel_contact/contact_sweep.h"
#include "symbolic/table_function.h"
#include <kempe/rolling_contact.h>
#include <kempe/vehicle.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* The SI unit of swept quantity k, a coordinate or a parameter. */
static const char *contact_unit(const kempe_contacts *t, int k)
{
    const int hold = t->swept[k].hold;
    const char *unit = hold < 0 ? kmp_quantity_unit_of(t->given, t->over.range[k].name)
                                : kmp_quantity_unit(t->system, KMP_QUANTITY_Q, t->hold[hold].coordinate);
    return kmp_print_unknown(t->given->context, unit);
}

/* The form of a unit in results. */
static kmp_shown contact_shown(const kempe_contacts *t, const char *unit)
{
    return kmp_shown_as(t->given->context, unit);
}

/* Sizes of wheels and rails are in mm, unless another unit is chosen. */
static kmp_shown shown_length(const kempe_contacts *t)
{
    return kmp_print_customary(t->given->context, "m", (kmp_shown){"mm", 1e3});
}

static const char *wheel_name(const kempe_contacts *t, int wheel)
{
    return kmp_model_wheel(t->system->model, wheel)->name;
}

/* -- text -------------------------------------------------------------------------------------------- */

enum { MOST_VALUES = 12, BLOCK = 7, INDENT = 4 };

/* Columns of the table of patches, in blocks that lines have room for. The SI unit, "": none, and the unit of texts in
 * SI, NULL: the same. */
typedef struct column {
    const char *head;
    double value;
    const char *unit;
    kmp_shown customary;
} column;

enum { PLACES, CREEPAGES, REQUESTED, BLOCKS };

/* The columns of a block; their number, 0: it was not requested. */
static int columns_of(const kempe_contacts *t, const kempe_contact_patch *p, int block, column of[BLOCK])
{
    const kmp_shown mm = {"mm", 1e3};
    const column places[] = {{"wheel", p->s, "m", mm},        {"rail", p->y, "m", mm},
                             {"angle", p->angle, "rad", {0}}, {"radius", p->radius, "m", mm},
                             {"N", p->normal, "N", {0}},      {"Fx", p->force[0], "N", {0}},
                             {"Fy", p->force[1], "N", {0}}};
    const column creepages[] = {{"along", p->slip[0], "", {0}},
                                {"across", p->slip[1], "", {0}},
                                {"spin", p->spin, "1/m", {0}},
                                {"Mz", p->moment, "N m", {0}}};
    const column by_law[] = {{"law Fx", p->by_law[0], "N", {0}}, {"law Fy", p->by_law[1], "N", {0}}};
    const column pressures[] = {{"p", p->pressure, "Pa", {"MPa", 1e-6}},
                                {"area", p->area, "m^2", {"mm2", 1e6}},
                                {"appr.", p->approach, "m", {"um", 1e6}},
                                {"lobes", p->lobes, "", {0}}};
    int count = 0;
    if (block == PLACES)
        for (; count < (int)(sizeof places / sizeof *places); count++)
            of[count] = places[count];
    if (block == CREEPAGES)
        for (; count < (int)(sizeof creepages / sizeof *creepages); count++)
            of[count] = creepages[count];
    for (int k = 0; block == REQUESTED && t->has_law && k < 2; k++)
        of[count++] = by_law[k];
    for (int k = 0; block == REQUESTED && t->pressure != KMP_PRESSURE_NONE && k < 4; k++)
        of[count++] = pressures[k];
    return count;
}

static kmp_shown column_shown(const kempe_contacts *t, const column *of)
{
    return of->customary.unit ? kmp_print_customary(t->given->context, of->unit, of->customary)
                              : contact_shown(t, of->unit);
}

static int column_width(const kempe_contacts *t, const column *of)
{
    const char *unit = column_shown(t, of).unit;
    return (int)fmax(10, (double)strlen(of->head) + (*unit ? 2 + (double)strlen(unit) : 0));
}

static int wheel_width(const kempe_contacts *t)
{
    int width = 5;
    for (int w = 0; w < t->wheel_count; w++)
        width = (int)fmax(width, (double)strlen(wheel_name(t, w)));
    return width;
}

/* The patches of a wheel at a value. */
static void show_wheel(kmp_text *text, const kempe_contacts *t, int row, int w, int block)
{
    const double value = contact_shown(t, contact_unit(t, 0)).factor * t->value[row];
    int touching = 0;
    for (int z = 0; z < kempe_contacts_zone_count(t, w); z++) {
        const kempe_contact_patch *p = kempe_contacts_patch(t, row, w, z);
        if (!p->touches)
            continue;
        kmp_text_printf(text, "%10.6g %-*s %4d", value, wheel_width(t), wheel_name(t, w), z + 1);
        column of[BLOCK];
        const int count = columns_of(t, p, block, of);
        for (int k = 0; k < count; k++)
            kmp_print_cells(text, " %*.5g", column_width(t, &of[k]), column_shown(t, &of[k]).factor * of[k].value);
        kmp_text_put(text, p->one_ellipse ? "\n" : " *\n");
        touching++;
    }
    if (touching == 0)
        kmp_text_printf(text, "%10.6g %-*s    - no contact\n", value, wheel_width(t), wheel_name(t, w));
}

/* Some values, evenly chosen, or all of them: first the places and forces, then what was requested. */
static void show_rows(kmp_text *text, const kempe_contacts *t, bool all)
{
    const kempe_contact_patch none = {0};
    column of[BLOCK];
    int blocks = 1 + (columns_of(t, &none, REQUESTED, of) > 0), most = MOST_VALUES / blocks;
    if (all || t->count <= most + most / 2)
        most = t->count;
    for (int block = 0; block < BLOCKS; block++) {
        const int columns = columns_of(t, &none, block, of);
        if (columns == 0 || (block == CREEPAGES && !all))
            continue;
        const char *swept = contact_shown(t, contact_unit(t, 0)).unit;
        kmp_text_printf(text, "\n%s%s%s\n%10s %-*s %4s", t->over.range[0].name, *swept ? ", " : "", swept, "",
                        wheel_width(t), "wheel", "zone");
        for (int k = 0; k < columns; k++) {
            const char *unit = column_shown(t, &of[k]).unit;
            const int room = column_width(t, &of[k]) - (int)strlen(of[k].head) - (*unit ? 2 + (int)strlen(unit) : 0);
            kmp_text_printf(text, " %*s%s%s%s", room, "", of[k].head, *unit ? ", " : "", unit);
        }
        kmp_text_put(text, "\n");
        for (int row = 0; row < t->count; row++)
            for (int w = 0; w < t->wheel_count; w++)
                if (most >= t->count || row == 0 || row == t->count - 1 ||
                    row * (most - 1) / (t->count - 1) != (row - 1) * (most - 1) / (t->count - 1))
                    show_wheel(text, t, row, w, block);
    }
    if (most < t->count)
        kmp_text_printf(text, "%d of %d values; all of them, and creepages: --all, -o FILE.csv\n", most, t->count);
}

/* Why some amplitudes have no conicity. */
static void say_unknown(kmp_text *text, const kempe_contacts *t)
{
    const kmp_conicities *c = &t->conicities;
    const kmp_shown size = shown_length(t);
    for (int k = 0; k < c->count; k++)
        if (isnan(c->at[k].conicity)) {
            kmp_text_printf(text, "  no motion with an amplitude of %.6g %s is inside ",
                            c->at[k].amplitude * size.factor, size.unit);
            if (c->points > 1)
                kmp_text_printf(
                    text, "y = %.6g to %.6g %s, where both wheels touch: sweep '%s' farther to both sides\n",
                    c->y[0] * size.factor, c->y[c->points - 1] * size.factor, size.unit, t->over.range[0].name);
            else
                kmp_text_printf(text, "the table: fewer than two values have contact at both wheels\n");
            return;
        }
}

static void show_conicities(kmp_text *text, const kempe_contacts *t)
{
    const kmp_conicities *c = &t->conicities;
    const kmp_shown size = shown_length(t), wave = contact_shown(t, "m");
    if (c->count == 0)
        return;
    kmp_text_printf(text,
                    "\nequivalent conicity of %s and %s (EN 15302), contacts %.6g %s apart, mean radius %.6g %s\n",
                    wheel_name(t, c->wheel[0]), wheel_name(t, c->wheel[1]), c->base * size.factor, size.unit,
                    c->radius * size.factor, size.unit);
    say_unknown(text, t);
    const int begin = 10 - (int)strlen(size.unit), wide = (int)strlen("wavelength, ") + (int)strlen(wave.unit);
    kmp_text_printf(text, "amplitude, %s  %10s  %10s  wavelength, %s  %*s%s  %*s%s\n", size.unit, "conicity", "error",
                    wave.unit, begin, "from, ", size.unit, begin, "to, ", size.unit);
    for (int k = 0; k < c->count; k++) {
        const kmp_conicity *at = &c->at[k];
        kmp_print_cells(text, "%13.6g  %10.5g  %10.2g  %*.5g  %10.5g  %10.5g\n", at->amplitude * size.factor,
                        at->conicity, at->error, wide, at->wavelength * wave.factor, at->low * size.factor,
                        at->high * size.factor);
    }
    if (!isnan(c->nonlinearity))
        kmp_text_printf(text, "nonlinearity parameter (conicity at 4 mm less that at 2 mm, over 2 mm): %.4g 1/%s\n",
                        c->nonlinearity / size.factor, size.unit);
    kmp_text_put(text, "error: with every second value only; from, to: ends of the motion, positive to the left\n");
}

static const char *trust_of(kmp_pressure_method method)
{
    switch (method) {
    case KMP_PRESSURE_KP:
        return "an approximation, pressures 5 to 20 % below those of one ellipse";
    case KMP_PRESSURE_ANALYN:
        return "an approximation: with two lobes pressures are off by up to 12 %, areas by up to 35 %";
    default:
        return "elastic half-spaces on a grid, pressures within 1 %, areas within 2 % of their solution";
    }
}

static void say_pressures(kmp_text *text, const kempe_contacts *t)
{
    if (t->pressure == KMP_PRESSURE_NONE)
        return;
    kmp_text line = {0};
    kmp_text_printf(&line,
                    "p: largest pressure by %s, with the area of all lobes and the approach: %s (docs/contact.md)",
                    kmp_pressure_word(t->pressure), trust_of(t->pressure));
    kmp_print_wrapped(text, "", INDENT, line.s ? line.s : "");
    kmp_text_free_part(text, &line);
    if (t->unknown_pressures > 0)
        kmp_text_printf(
            text, "-: patches without pressure: %d; their contact would reach the end of a zone or of a profile\n",
            t->unknown_pressures);
    if (t->unknown_forces > 0)
        kmp_text_printf(text, "-: patches without forces by half-space: %d; their tractions do not become steady\n",
                        t->unknown_forces);
}

/* The conicity at 3 mm, which EN 15302 requires, otherwise at the middle amplitude. */
static void put_conicity(kmp_text *text, const kempe_contacts *t)
{
    const double asked = 3e-3;
    const kmp_conicities *c = &t->conicities;
    const kmp_shown size = shown_length(t);
    const kmp_conicity *at = &c->at[c->count / 2];
    for (int k = 0; k < c->count; k++)
        at = fabs(c->at[k].amplitude - asked) < 1e-6 * asked ? &c->at[k] : at;
    if (isnan(at->conicity))
        kmp_text_put(text, ": equivalent conicity unknown at ");
    else
        kmp_text_printf(text, ": equivalent conicity %.5g at ", at->conicity);
    kmp_text_printf(text, "%.6g %s", at->amplitude * size.factor, size.unit);
}

static void show_title(kmp_text *text, const kempe_contacts *t)
{
    kmp_text title = {0};
    kmp_print_title(&title, t->system->model, kmp_outcome_of(t->status));
    for (int k = 0; k < t->over.count; k++) {
        const kmp_range *r = &t->over.range[k];
        const kmp_shown as = contact_shown(t, contact_unit(t, k));
        kmp_text_printf(&title, "%s %s%.6g", r->name, r->from != r->to ? "from " : "", as.factor * r->from);
        if (r->from != r->to)
            kmp_text_printf(&title, " to %.6g", as.factor * r->to);
        kmp_text_printf(&title, "%s%s, ", *as.unit ? " " : "", as.unit);
    }
    if (t->count < t->requested)
        kmp_text_printf(&title, "%d of ", t->count);
    kmp_text_printf(&title, "%d values", t->requested);
    if (t->conicities.count > 0)
        put_conicity(&title, t);
    kmp_print_answer(text, &title, kmp_outcome_of(t->status), t->warnings, "  ", t->reason);
}

/* Steady rates. */
static void show_rates(kmp_text *text, const kempe_contacts *t)
{
    const kempe_model *model = t->system->model;
    for (int k = 0; k < t->hold_count; k++) {
        int c = t->hold[k].coordinate;
        const char *unit = kmp_print_unit(t->system, c);
        if (t->hold[k].how == KMP_RATE_FREED)
            kmp_text_printf(text, "  %s turns without driving torque, at first at %.6g %s/s\n",
                            kmp_model_motion(model, c)->name, t->count ? kmp_print_value(t->system, c, t->qd[c]) : NAN,
                            unit);
        else if (t->hold[k].rate != 0)
            kmp_text_printf(text, "  %s turns at the prescribed rate %.6g %s/s\n", kmp_model_motion(model, c)->name,
                            kmp_print_value(t->system, c, t->hold[k].rate), unit);
    }
}

/* The meaning of the columns. */
static void show_legend(kmp_text *text, const kempe_contacts *t, bool all)
{
    int patches = 0, other = 0; /* the ones that are not elliptic */
    for (int row = 0; row < t->count; row++)
        for (int w = 0; w < t->wheel_count; w++)
            for (int z = 0; z < kempe_contacts_zone_count(t, w); z++) {
                const kempe_contact_patch *p = kempe_contacts_patch(t, row, w, z);
                patches += p->touches;
                other += p->touches && p->one_ellipse == 0;
            }
    kmp_text_put(text, "\n");
    kmp_print_wrapped(
        text, "", INDENT,
        "wheel, rail: lateral positions, outwards, from the nominal radius and the track centre; N: normal "
        "force; Fx, Fy: forces on the wheel, forwards and to the left");
    if (t->has_law)
        kmp_text_printf(text, "law: the same forces by %s\n", kmp_contact_law_word(t));
    if (all)
        kmp_text_put(text, "along, across: creepages of the wheel, forwards and to the left; Mz: moment on it\n");
    if (other > 0)
        kmp_text_printf(text, "*: not elliptic, %d of %d patches: pressures may be several times 3 N / (2 pi a b)\n",
                        other, patches);
    say_pressures(text, t);
}

static void show_parts(kmp_text *text, const kempe_contacts *t, bool all)
{
    show_title(text, t);
    show_rates(text, t);
    kmp_text_printf(text, "  The other coordinates are in equilibrium: forces balance to %.2g of the largest",
                    t->residual);
    kmp_backend_print(text, t->backend);
    kmp_text_put(text, "\n");
    show_conicities(text, t);
    show_legend(text, t, all);
    show_rows(text, t, all);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static const kmp_patch_outline *outline_of(const kempe_contacts *t, const kempe_contact_patch *p)
{
    return &t->outline[p - t->patch];
}

static void put_patch(kmp_json *json, const kempe_contacts *t, const kempe_contact_patch *p)
{
    kmp_json_put(json, "{ touches %i s %g y %g angle %g radius %g normal %g", p->touches, p->s, p->y, p->angle,
                 p->radius, p->normal);
    kmp_json_numbers(json, "slip", 2, p->slip);
    kmp_json_number(json, "spin", p->spin);
    kmp_json_numbers(json, "force", 2, p->force);
    kmp_json_put(json, "moment %g a %g b %g", p->moment, p->a, p->b);
    if (p->one_ellipse < 0)
        kmp_json_string(json, "one_ellipse", NULL);
    else
        kmp_json_boolean(json, "one_ellipse", p->one_ellipse);
    if (t->has_law)
        kmp_json_numbers(json, "by_law", 2, p->by_law);
    if (t->pressure != KMP_PRESSURE_NONE) {
        /* The numbers of a patch for the method of the options, and its outline. */
        const kmp_patch_outline *of = outline_of(t, p);
        kmp_json_put(json, "pressure %g area %g approach %g lobes %d outline [", p->pressure, p->area, p->approach,
                     p->lobes);
        for (int k = 0; k < of->count; k++) {
            const kmp_outline_strip *s = &of->strip[k];
            kmp_json_put(json, "{ lobe %d y %g from %g to %g pressure %g }", s->lobe, s->y, s->from, s->to,
                         s->pressure);
        }
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

static void put_conicities(kmp_json *json, const kempe_contacts *t)
{
    const kmp_conicities *c = &t->conicities;
    if (c->count == 0)
        return;
    kmp_json_put(json, "conicity { left %s right %s base %g radius %g nonlinearity %g", wheel_name(t, c->wheel[0]),
                 wheel_name(t, c->wheel[1]), c->base, c->radius, c->nonlinearity);
    kmp_json_numbers(json, "y", c->points, c->y);
    kmp_json_numbers(json, "difference", c->points, c->difference);
    kmp_json_array(json, "rows");
    for (int k = 0; k < c->count; k++)
        kmp_json_put(json, "{ amplitude %g conicity %g error %g wavelength %g low %g high %g }", c->at[k].amplitude,
                     c->at[k].conicity, c->at[k].error, c->at[k].wavelength, c->at[k].low, c->at[k].high);
    kmp_json_put(json, "] }");
}

static void show_json(kmp_text *text, const void *result)
{
    const kempe_contacts *t = result;
    kmp_json json =
        kmp_print_head(text, t->system, kmp_outcome_of(t->status), t->reason, t->system->build_s, t->warnings);
    kmp_json_put(&json, "over %s unit %s law %s pressure %s residual %g iterations %d backend %s cpu_s %g rows [",
                 t->over.range[0].name, contact_unit(t, 0), kmp_contact_law_word(t), kmp_pressure_word(t->pressure),
                 t->residual, t->iterations, t->backend, t->cpu_s);
    for (int row = 0; row < t->count; row++) {
        kmp_json_put(&json, "{ value %g", t->value[row]);
        kmp_print_entries(&json, "q", t->system, KMP_QUANTITY_Q, t->q + (ptrdiff_t)row * t->system->n);
        kmp_print_entries(&json, "qd", t->system, KMP_QUANTITY_QD, t->qd + (ptrdiff_t)row * t->system->n);
        kmp_json_object(&json, "wheels");
        for (int w = 0; w < t->wheel_count; w++) {
            kmp_json_array(&json, wheel_name(t, w));
            for (int z = 0; z < kempe_contacts_zone_count(t, w); z++)
                put_patch(&json, t, kempe_contacts_patch(t, row, w, z));
            kmp_json_end(&json);
        }
        kmp_json_put(&json, "} }");
    }
    kmp_json_put(&json, "]");
    put_conicities(&json, t);
    kmp_json_put(&json, "}");
}

KMP_PRINT_FULL(kempe_contacts, contacts, contacts->given->context, show_json, show_parts)

/* -- tables ------------------------------------------------------------------------------------------ */

static void fill_row(kempe_table *to, const kempe_contacts *t, int row, int wheel, int zone)
{
    const kempe_contact_patch *p = kempe_contacts_patch(t, row, wheel, zone);
    KMP_TABULATE(to, "%g %s %d %d %g %g %g %g %g", t->value[row], wheel_name(t, wheel), zone + 1, p->touches, p->s,
                 p->y, p->angle, p->radius, p->normal);
    kmp_tabulate_cells(to, "%g %g %g %g %g %g %g %g", p->slip[0], p->slip[1], p->spin, p->force[0], p->force[1],
                       p->moment, p->a, p->b);
    kmp_tabulate_numbers(to, t->has_law ? 2 : 0, p->by_law);
    kmp_tabulate_number(to, p->one_ellipse < 0 ? NAN : (double)p->one_ellipse);
    if (t->pressure != KMP_PRESSURE_NONE)
        kmp_tabulate_cells(to, "%g %g %g %d", p->pressure, p->area, p->approach, p->lobes);
}

static void fill_rows(kempe_table *to, const void *result)
{
    const kempe_contacts *t = result;
    kmp_tabulate_column(to, contact_unit(t, 0), "%s", t->over.range[0].name);
    kmp_tabulate_columns(to,
                         "wheel[words] zone touches s[m] y[m] angle[rad] radius[m] normal[N] slip.x slip.y spin[1/m] "
                         "force.x[N] force.y[N] moment[N m] a[m] b[m]");
    kmp_tabulate_columns(to, t->has_law ? "by_law.x[N] by_law.y[N] one_ellipse" : "one_ellipse");
    if (t->pressure != KMP_PRESSURE_NONE)
        kmp_tabulate_columns(to, "pressure[Pa] area[m^2] approach[m] lobes");
    kmp_tabulate_apart(to);
    for (int row = 0; row < t->count; row++)
        for (int w = 0; w < t->wheel_count; w++)
            for (int z = 0; z < kempe_contacts_zone_count(t, w); z++)
                fill_row(to, t, row, w, z);
}

static void fill_outline(kempe_table *to, const void *result)
{
    const kempe_contacts *t = result;
    kmp_tabulate_column(to, contact_unit(t, 0), "%s", t->over.range[0].name);
    kmp_tabulate_columns(to, "wheel[words] zone lobe y[m] from[m] to[m] pressure[Pa]");
    for (int row = 0; t->outline && row < t->count; row++)
        for (int w = 0; w < t->wheel_count; w++)
            for (int z = t->first[w]; z < t->first[w + 1]; z++) {
                const kmp_patch_outline *of = outline_of(t, kempe_contacts_patch(t, row, w, z - t->first[w]));
                for (int k = 0; k < of->count; k++) {
                    const kmp_outline_strip *s = &of->strip[k];
                    KMP_TABULATE(to, "%g %s %d %d %g %g %g %g", t->value[row], wheel_name(t, w), z - t->first[w] + 1,
                                 s->lobe, s->y, s->from, s->to, s->pressure);
                }
            }
}

static void fill_states(kempe_table *to, const void *result)
{
    const kempe_contacts *t = result;
    int n = t->system->n;
    kmp_tabulate_column(to, contact_unit(t, 0), "%s", t->over.range[0].name);
    kmp_tabulate_quantity(to, t->system, KMP_QUANTITY_Q);
    kmp_tabulate_quantity(to, t->system, KMP_QUANTITY_QD);
    for (int row = 0; row < t->count; row++) {
        kmp_tabulate_row(to);
        kmp_tabulate_number(to, t->value[row]);
        kmp_tabulate_values(to, t->system, KMP_QUANTITY_Q, t->q + (ptrdiff_t)row * n);
        kmp_tabulate_values(to, t->system, KMP_QUANTITY_QD, t->qd + (ptrdiff_t)row * n);
    }
}

static void fill_conicities(kempe_table *to, const void *result)
{
    const kempe_contacts *t = result;
    kmp_tabulate_columns(to, "amplitude[m] conicity error wavelength[m] low[m] high[m]");
    for (int k = 0; k < t->conicities.count; k++) {
        const kmp_conicity *at = &t->conicities.at[k];
        KMP_TABULATE(to, "%g %g %g %g %g %g", at->amplitude, at->conicity, at->error, at->wavelength, at->low,
                     at->high);
    }
}

static void fill_radii(kempe_table *to, const void *result)
{
    const kmp_conicities *c = &((const kempe_contacts *)result)->conicities;
    kmp_tabulate_columns(to, "y[m] difference[m]");
    for (int k = 0; k < c->points; k++)
        KMP_TABULATE(to, "%g %g", c->y[k], c->difference[k]);
}

KMP_TABLES(kempe_contacts, contacts, contacts->given->context, {"rows", fill_rows}, {"states", fill_states},
           {"conicity", fill_conicities}, {"radii", fill_radii}, {"outline", fill_outline})

/* -- pictures -------------------------------------------------------------------------------------------- */

/* For each wheel it has the two profiles, a little apart, with the points that touch
 * at each value joined; below, the contacts' values over the swept quantity. */

enum { WIDTH = 1000, SECTION = 340, PANEL = 260, FINE = 400, LINE = 20 };

#define APART 0.012 /* the wheel is drawn so far above the rail, m */

static const char style[] = ".wheel{fill:none;stroke:#222;stroke-width:1.8}.rail{fill:#e8e8e8;stroke:#222;"
                            "stroke-width:1.8}.join{fill:none;stroke-width:.9}";

typedef struct shade {
    char words[32];
} shade;

/* A colour of SVG, from blue at the first value to red at the last. */
static shade shade_of(const kempe_contacts *t, int row)
{
    double part = t->count > 1 ? (double)row / (t->count - 1) : 0;
    shade s;
    (void)snprintf(s.words, sizeof s.words, "hsl(%.0f 75%% 42%%)", 230 - 230 * part);
    return s;
}

/* -- the profiles ---------------------------------------------------------------------------------------- */

/* A wheel over its rail: lateral places are on the track, mm, the wheel's where it is at the first value. */
typedef struct section {
    kmp_plot plot;
    const struct kmp_table *wheel, *rail;
    double shift;  /* from a place on the wheel to one on the track, m */
    double factor; /* of lengths from m */
} section;

static void go_to(section *s, bool rail, double place)
{
    double height = kmp_table_value(rail ? s->rail : s->wheel, 0, place);
    kmp_curve_to(&s->plot, (place + (rail ? 0 : s->shift)) * s->factor, (height + (rail ? 0 : APART)) * s->factor);
}

static void put_profile(section *s, bool rail)
{
    const struct kmp_table *table = rail ? s->rail : s->wheel;
    double from = table->x[0], to = table->x[table->count - 1];
    kmp_curve_begin(&s->plot, rail ? "rail" : "wheel", NULL);
    for (int k = 0; k <= FINE; k++)
        go_to(s, rail, from + (to - from) * k / FINE);
    kmp_curve_end(&s->plot);
}

/* The lateral distance of the wheel from its rail where it touches first. */
static double find_shift(const kempe_contacts *t, int wheel)
{
    for (int row = 0; row < t->count; row++)
        for (int z = 0; z < kempe_contacts_zone_count(t, wheel); z++) {
            const kempe_contact_patch *p = kempe_contacts_patch(t, row, wheel, z);
            if (p->touches)
                return p->y - p->s;
        }
    return 0;
}

static void put_section(kmp_text *text, const kempe_contacts *t, int wheel, double x, double y, double width)
{
    const kmp_wheel *w = kmp_model_wheel(t->system->model, wheel);
    const kmp_track *track = kmp_model_track(t->system->model, w->track);
    const kmp_shown size = shown_length(t);
    section s = {kmp_plot_inside(text, x, y, width, SECTION), w->profile->height, track->rail, find_shift(t, wheel),
                 size.factor};
    for (int i = 0; i < s.wheel->count; i++)
        kmp_plot_reach(&s.plot, (s.wheel->x[i] + s.shift) * s.factor, (s.wheel->y[i] + APART) * s.factor);
    for (int i = 0; i < s.rail->count; i++)
        kmp_plot_reach(&s.plot, s.rail->x[i] * s.factor, s.rail->y[i] * s.factor);
    s.plot.axis[0].name = "from the track's middle, outwards";
    s.plot.axis[0].unit = size.unit;
    s.plot.axis[0].reversed = w->side == KMP_TRACK_LEFT;
    s.plot.square = true;
    kmp_plot_begin(&s.plot, "%s (%s)", w->name, kmp_track_side_words[w->side]);
    put_profile(&s, true);
    put_profile(&s, false);
    /* Lines between the points that touch. */
    for (int row = 0; row < t->count; row++)
        for (int z = 0; z < kempe_contacts_zone_count(t, wheel); z++) {
            const kempe_contact_patch *p = kempe_contacts_patch(t, row, wheel, z);
            if (!p->touches)
                continue;
            kmp_curve_begin(&s.plot, "join", shade_of(t, row).words);
            go_to(&s, true, p->y);
            go_to(&s, false, p->s);
            kmp_curve_end(&s.plot);
        }
    kmp_plot_end(&s.plot);
}

/* -- curves ---------------------------------------------------------------------------------------------- */

/* A number of patches over the values, by its place in the patch; `law`: the one by the law in the options, 0: none.
 * The unit of SI, and the unit of pictures in SI. */
typedef struct panel {
    const char *title, *unit;
    size_t value, law;
    kmp_shown customary;
} panel;

#define AT(member) offsetof(kempe_contact_patch, member)

static const panel panels[] = {{"rolling radius", "m", AT(radius), 0, {"mm", 1e3}},
                               {"contact angle", "rad", AT(angle), 0, {"rad", 1}},
                               {"normal force", "N", AT(normal), 0, {"kN", 1e-3}},
                               {"force along", "N", AT(force[0]), AT(by_law[0]), {"kN", 1e-3}},
                               {"force across", "N", AT(force[1]), AT(by_law[1]), {"kN", 1e-3}}};

enum { PANELS = sizeof panels / sizeof *panels, PANELS_A_LINE = 3 };

/* NaN: there is no contact. */
static double value_of(const kempe_contact_patch *p, size_t at, double factor)
{
    return p->touches ? *(const double *)(const void *)((const char *)p + at) * factor : NAN;
}

static int patches_a_value(const kempe_contacts *t)
{
    return t->first[t->wheel_count];
}

/* A swept value as the axis has it. */
static double swept(const kempe_contacts *t, int row)
{
    return contact_shown(t, contact_unit(t, 0)).factor * t->value[row];
}

/* A patch over the values; `at`: its number of the panel. */
static void put_curve(kmp_plot *plot, const kempe_contacts *t, int patch, size_t at, double factor)
{
    for (int row = 0; row < t->count; row++)
        kmp_curve_to(plot, swept(t, row), value_of(&t->patch[row * patches_a_value(t) + patch], at, factor));
    kmp_curve_end(plot);
}

static void put_panel(kmp_text *text, const kempe_contacts *t, const panel *of, double x, double y, double width)
{
    kmp_plot plot = kmp_plot_inside(text, x, y, width, PANEL);
    const kmp_shown shown = kmp_print_customary(t->given->context, of->unit, of->customary);
    const double factor = shown.factor;
    for (int k = 0; k < t->count * patches_a_value(t); k++) {
        double at = swept(t, k / patches_a_value(t));
        kmp_plot_reach(&plot, at, value_of(&t->patch[k], of->value, factor));
        kmp_plot_reach(&plot, at, of->law ? value_of(&t->patch[k], of->law, factor) : NAN);
    }
    plot.axis[0].name = t->over.range[0].name;
    plot.axis[0].unit = contact_shown(t, contact_unit(t, 0)).unit;
    kmp_plot_begin(&plot, "%s, %s", of->title, shown.unit);
    for (int w = 0; w < t->wheel_count; w++)
        for (int z = t->first[w]; z < t->first[w + 1]; z++) {
            kmp_curve_begin(&plot, "curve", kmp_plot_colour(w));
            put_curve(&plot, t, z, of->value, factor);
            if (!of->law || !t->has_law)
                continue;
            kmp_curve_begin(&plot, "dashed", kmp_plot_colour(w));
            put_curve(&plot, t, z, of->law, factor);
        }
    kmp_plot_end(&plot);
}

/* The difference of the rolling radii over the lateral place, or the conicity over the amplitude. */
static void draw_conicities(kmp_text *text, const kempe_contacts *t, bool radii, double x, double y, double width)
{
    const kmp_conicities *c = &t->conicities;
    const kmp_shown size = shown_length(t);
    kmp_plot plot = kmp_plot_inside(text, x, y, width, PANEL);
    int count = radii ? c->points : c->count;
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < count; k++) {
            double across = (radii ? c->y[k] : c->at[k].amplitude) * size.factor;
            double up = radii ? c->difference[k] * size.factor : c->at[k].conicity;
            if (pass == 0)
                kmp_plot_reach(&plot, across, up);
            else
                kmp_curve_to(&plot, across, up);
        }
        if (pass == 0) {
            plot.axis[0].name = radii ? "y, positive to the left" : "amplitude";
            plot.axis[0].unit = size.unit;
            kmp_plot_begin(&plot, "%s%s", radii ? "left rolling radius less right one, " : "equivalent conicity",
                           radii ? size.unit : "");
            kmp_curve_begin(&plot, "curve", kmp_plot_colour(0));
        }
    }
    kmp_curve_end(&plot);
    kmp_plot_end(&plot);
}

kempe_status kempe_contacts_write_picture(const kempe_contacts *t, const char *path)
{
    KMP_WANTED(NULL, t, "table");
    KMP_WANTED(t->given->context, path, "path");
    kempe_context *context = t->given->context;
    kmp_text text = {0};
    int lines = (t->wheel_count + 1) / 2, columns = t->wheel_count > 1 ? 2 : 1;
    int below = lines * SECTION + (PANELS + 1 + PANELS_A_LINE - 1) / PANELS_A_LINE * PANEL;
    int height = below + (t->conicities.count > 0 ? PANEL : 0);
    double width = WIDTH / (double)columns, narrow = WIDTH / (double)PANELS_A_LINE;
    kmp_context_clear(context);
    kmp_picture_begin(&text, WIDTH, height, style);
    for (int w = 0; w < t->wheel_count; w++) {
        int line = w / columns;
        put_section(&text, t, w, w % columns * width, line * SECTION, width);
    }
    for (int k = 0; k < PANELS; k++) {
        int line = k / PANELS_A_LINE;
        put_panel(&text, t, &panels[k], k % PANELS_A_LINE * narrow, lines * SECTION + line * PANEL, narrow);
    }
    /* In the last panel's place: the legend of the wheels' colours. */
    double x = WIDTH - narrow + 4 * LINE, y = below - PANEL + 3 * LINE;
    for (int w = 0; w < t->wheel_count; w++, y += LINE)
        kmp_picture_entry(&text, x, y, "curve", kmp_plot_colour(w), "%s", kmp_model_wheel(t->system->model, w)->name);
    if (t->has_law)
        kmp_picture_entry(&text, x, y, "dashed", "#222", "by %s", kmp_contact_law_word(t));
    kmp_picture_words(&text, x, y + 1.5 * LINE, "", "lines join what touches, from");
    kmp_picture_entry(&text, x, y + 2.5 * LINE, "curve", shade_of(t, 0).words, "%.6g to", swept(t, 0));
    const char *unit = contact_shown(t, contact_unit(t, 0)).unit;
    kmp_picture_entry(&text, x, y + 3.5 * LINE, "curve", shade_of(t, t->count - 1).words, "%.6g%s%s",
                      swept(t, t->count - 1), unit[0] ? " " : "", unit);
    for (int k = 0; k < 2 && t->conicities.count > 0; k++)
        draw_conicities(&text, t, k == 0, k * WIDTH / 2.0, below, WIDTH / 2.0);
    kmp_picture_end(&text);
    return kmp_picture_write(context, path, &text);
}
