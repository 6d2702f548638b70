/* SPDX-License-Identifier: BSD-3-Clause */
/* Deflections are taken at stations in the axes of the body; of a body without any beyond its origin, its coordinates
 * in metres. */
#include "studies/simulate/flexible_doubts.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/closing/load_margin.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/flexible/body_spectrum.h"
#include "model/language/expression_value.h"
#include "studies/simulate/trajectory.h"
#include <math.h>

static double deflection_at(const kmp_flexible *f, const kmp_station *station, const double *parameters,
                            const double *q)
{
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        double way = 0;
        for (int k = 0; k < f->count; k++) {
            way += kmp_number_at(&station->shift[f->count * c + k], parameters) * q[k];
            for (int l = 0; l < f->count; l++)
                way += kmp_number_at(&station->shift_more[(ptrdiff_t)(f->count * c + k) * f->count + l], parameters) *
                       q[k] * q[l] / 2;
        }
        sum += way * way;
    }
    return sqrt(sum);
}

/* The largest deflection of a flexible body at q, in its axes, with the system's values of parameters. */
static double deflection_of(const kempe_system *system, const kmp_flexible *f, const double *q)
{
    double most = 0;
    for (int s = 0; s < f->station_count; s++)
        most = fmax(most, deflection_at(f, &f->stations[s], system->parameters, q + f->first));
    for (int k = f->first; k < f->first + f->count && f->station_count == 1; k++)
        most = system->model->motions[k].rotation ? most : fmax(most, fabs(q[k]));
    return most;
}

void kmp_doubt_deflections(const kempe_system *system, int count, const double *q(const void *user, int k),
                           const void *user)
{
    const kempe_model *model = system->model;
    for (int b = 0; b < model->flexible_count; b++) {
        const kmp_flexible *f = &model->flexibles[b];
        double most = 0;
        for (int k = 0; k < count; k++)
            most = fmax(most, deflection_of(system, f, q(user, k)));
        if (most > KMP_DEFLECTION_LARGE * f->length->value)
            kmp_doubt(system->context,
                      "flexible body '%s' deflects by %.3g m, %.2f of its length: shapes with terms of second order "
                      "are right for up to %.1f; divide it into %s",
                      model->bodies[f->body].name, most, most / f->length->value, KMP_DEFLECTION_LARGE,
                      kmp_flexible_parts(f));
    }
}

static const double *itself(const void *q, int k)
{
    (void)k;
    return q;
}

void kmp_doubt_deflection(const kempe_system *system, const double *q)
{
    kmp_doubt_deflections(system, 1, itself, q);
}

/* The largest one of all rows. */
static double largest_deflection(const kempe_system *system, const kmp_samples *table, const kmp_flexible *f)
{
    double most = 0;
    for (int row = 0; row < table->rows; row++)
        most = fmax(most, deflection_of(system, f, kmp_samples_get(table, KMP_QUANTITY_Q, row)));
    return most;
}

/* Without terms of second order rotation softens a beam in place of stiffening it. A motion that is too fast for that
 * is doubted along its way. */
static void warn_of_rotation(const kempe_system *system, const kmp_samples *table, const kmp_flexible *f)
{
    const kempe_model *model = system->model;
    kmp_flexible_spectrum s;
    double most = 0;
    if (f->count == 0 || (f->stiffening != KMP_STIFFENING_NONE && !f->averaged) || !kmp_flexible_spectrum_find(f, &s))
        return;
    for (int row = 0; row < table->rows; row++) {
        const double *qd = kmp_samples_get(table, KMP_QUANTITY_QD, row);
        for (int b = f->body; b > 0; b = model->bodies[b].parent)
            for (int k = 0; k < model->bodies[b].motion_count; k++) {
                const int motion = model->bodies[b].first_motion + k;
                most = model->motions[motion].rotation ? fmax(most, fabs(qd[motion])) : most;
            }
    }
    if (most > KMP_ROTATION_SLOW * s.fixed[0] && most <= kmp_flexible_fastest(f))
        kmp_log(system->context, KEMPE_LOG_WARNING,
                "flexible body '%s' turns with %.4g rad/s, %.2f of its first frequency, without terms of second order, "
                "which stiffen it: %s",
                model->bodies[f->body].name, most, most / s.fixed[0],
                f->file ? "write terms of second order into its file" : "take stiffening 'first' or 'full'");
}

/* Moments of a section by its loads (about x, y, z in `load`) and by the strain of shapes. */
static void compare_moments(const kmp_flexible *f, const kmp_station *station, const double *q, const double load[3],
                            double *off, double *size)
{
    for (int c = 0; c < 3; c++) {
        double strained = 0;
        bool has = false;
        for (int k = 0; k < f->count; k++) {
            strained += station->strained[f->count * c + k].value * q[f->first + k];
            has = has || station->strained[f->count * c + k].value != 0;
        }
        if (has)
            *off = fmax(*off, fabs(strained - load[c]));
        *size = has ? fmax(*size, fmax(fabs(load[c]), fabs(strained))) : *size;
    }
}

static void warn_of_section(const kmp_samples *table, kmp_evaluator *eval, const kmp_output *output, int at)
{
    const kempe_model *model = eval->system->model;
    const kmp_point *point = &model->points[output->index];
    const kmp_flexible *f = &model->flexibles[model->bodies[point->body].flexible - 1];
    const kmp_station *station = &f->stations[point->station > 0 ? point->station - 1 : 0];
    double off = 0, size = 0, force = 0;
    for (int row = 0; row < table->rows; row++) {
        const double *load = kmp_samples_shown(table, eval, row) + at;
        for (int c = 0; c < 3; c++)
            force = fmax(force, fabs(load[c]));
        compare_moments(f, station, kmp_samples_get(table, KMP_QUANTITY_Q, row), load + 3, &off, &size);
    }
    if (size > KMP_SECTION_REST * force * f->length->value && off > KMP_SECTION_RESOLVED * size)
        kmp_log(eval->system->context, KEMPE_LOG_WARNING,
                "section '%s.%s': its moments by loads and by strain of the shapes differ by up to %.2g N m, %.0f %% "
                "of the largest; compare with more shapes",
                model->bodies[point->body].name, point->name, off, 100 * off / size);
}

/* A straight beam stays so in the computation under loads at which it buckles: such a motion is not the motion of the
 * beam.
 */
static void report_buckling(const kempe_system *system, const kmp_samples *table, const kmp_flexible *f, double t,
                            double taken)
{
    const char *name = system->model->bodies[f->body].name;
    if (largest_deflection(system, table, f) <= KMP_DEFLECTION_NONE * f->length->value)
        kmp_doubt(system->context,
                  "flexible body '%s' buckles: at t = %.6g s its loads take %.3g times its stiffness, and it stays "
                  "straight because no load deflects it; start with a small deflection",
                  name, t, taken);
    else
        kmp_log(system->context, KEMPE_LOG_WARNING,
                "flexible body '%s' buckles: at t = %.6g s its loads take %.3g times its stiffness; it stays straight "
                "in directions in which no load deflects it",
                name, t, taken);
}

static kempe_status warn_of_buckling(const kempe_system *system, const kmp_samples *table)
{
    enum { LOOKS = 12 }; /* rows that are looked at, from the first one to the last */
    const kempe_model *model = system->model;
    const int n = model->flexible_count, last = table->rows - 1, step = last < LOOKS ? 1 : last / (LOOKS - 1);
    kmp_load_margin *margin = NULL;
    if (n == 0 || last < 0)
        return KEMPE_OK;
    double *taken = KMP_NEW(double, 3 * n);
    const kempe_status status = taken ? kmp_load_margin_new(system, kmp_samples_get(table, KMP_QUANTITY_Q, 0),
                                                            kmp_samples_get(table, KMP_QUANTITY_QD, 0), &margin)
                                      : kmp_fail_memory(system->context);
    for (int row = 0; margin && row <= last; row += step) {
        kmp_load_margin_at(margin, kmp_samples_time(table, row), kmp_samples_get(table, KMP_QUANTITY_Q, row),
                           kmp_samples_get(table, KMP_QUANTITY_QD, row), kmp_samples_get(table, KMP_QUANTITY_QDD, row),
                           taken);
        for (int k = 0; k < n; k++)
            if (taken[k] > taken[n + k]) {
                taken[n + k] = taken[k];
                taken[2 * n + k] = kmp_samples_time(table, row);
            }
    }
    for (int k = 0; margin && k < n; k++)
        if (taken[n + k] >= 1)
            report_buckling(system, table, &model->flexibles[k], taken[2 * n + k], taken[n + k]);
    kmp_load_margin_free(margin);
    kmp_free(taken);
    return status;
}

kempe_status kmp_doubt_flexible(const kmp_samples *table, kmp_evaluator *eval)
{
    const kempe_model *model = eval->system->model;
    for (int k = 0; k < model->flexible_count; k++)
        warn_of_rotation(eval->system, table, &model->flexibles[k]);
    for (int o = 0, at = 0; o < model->output_count; at += kmp_output_width(model, &model->outputs[o++]))
        if (model->outputs[o].kind == KMP_OUTPUT_SECTION)
            warn_of_section(table, eval, &model->outputs[o], at);
    return warn_of_buckling(eval->system, table);
}
