/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/sensitivity/run_differences.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "derivatives/linearized.h"
#include "studies/simulate/trajectory.h"
#include <kempe/output_handles.h>
#include <math.h>
#include <string.h>

/* Places of a parameter: two on each side. */
enum { PLACES = 4 };

static const double place[PLACES] = {-2, -1, 1, 2};

typedef struct differences {
    kempe_sensitivity *s;
    kempe_run_options run;
    const char *words;
    int count;
    const double *t;
    double *values, *row;         /* of a run; of all outputs */
    double *cells, *cell[PLACES]; /* count x columns: at the values, and beside them */
    bool known[PLACES];
    kmp_run_report report; /* of the run at the values */
    kmp_arena arena;
} differences;

/* -- one run ----------------------------------------------------------------------------------------- */

static kempe_status fill_cells(differences *d, kempe_trajectory *motion, double *cells)
{
    const kempe_sensitivity *s = d->s;
    kempe_outputs *outputs = NULL;
    const bool quiet = kmp_context_quiet(s->context, true); /* outputs have no warnings of their own */
    kempe_status status = kempe_outputs_new(s->system, d->words, &outputs);
    for (int row = 0; row < d->count && status == KEMPE_OK; row++) {
        status = kempe_outputs_at_time(outputs, motion, d->t[row], d->row);
        for (int c = 0; c < s->columns && status == KEMPE_OK; c++)
            cells[(ptrdiff_t)row * s->columns + c] = d->row[kempe_outputs_find(outputs, s->column[c])];
    }
    kempe_outputs_free(outputs);
    (void)kmp_context_quiet(s->context, quiet);
    return status;
}

/* The columns at all times. KEMPE_E_FAILED: the motion does not reach the last one. */
static kempe_status run_at(differences *d, const double *values, double *cells)
{
    kempe_sensitivity *s = d->s;
    kmp_linear none = {0};
    kempe_trajectory *motion = NULL;
    KMP_TRY(kmp_linear_vary(&none, s->system, s->variant, values));
    kempe_status status = kmp_simulate(s->system, &d->run, &motion);
    if (motion && (motion->report.requested || (status == KEMPE_STOPPED && !motion->interrupted)))
        status = kmp_fail(s->context, KEMPE_E_FAILED, "%s", motion->reason);
    if (status == KEMPE_OK)
        status = fill_cells(d, motion, cells);
    if (motion)
        d->report = motion->report;
    d->report.reason = NULL;
    kempe_trajectory_free(motion);
    return status;
}

/* -- derivatives ------------------------------------------------------------------------------------- */

/* The derivative from values at the places, and that at twice the step. Of one side alone: from two places there, and
 * from the farther one. */
static void slope_of(const differences *d, ptrdiff_t i, double step, double *slope, double *rough)
{
    const double x = d->cells[i];
    if (d->known[0] && d->known[1] && d->known[2] && d->known[3]) {
        double far = (d->cell[3][i] - d->cell[0][i]) / (4 * step), near = (d->cell[2][i] - d->cell[1][i]) / (2 * step);
        *slope = (4 * near - far) / 3;
        *rough = far;
        return;
    }
    const bool after = d->known[2] && d->known[3];
    const double near = after ? (d->cell[2][i] - x) / step : (x - d->cell[1][i]) / step,
                 far = (after ? d->cell[3][i] - x : x - d->cell[0][i]) / (2 * step);
    *slope = 2 * near - far;
    *rough = near;
}

static kempe_status differ_by(differences *d, const double *values, int k)
{
    const double step = KMP_RUN_STEP * d->s->size[k];
    kempe_status status = KEMPE_OK;
    for (int i = 0; i < PLACES; i++) {
        memcpy(d->values, values, (size_t)d->s->count * sizeof *values);
        d->values[k] += place[i] * step;
        status = run_at(d, d->values, d->cell[i]);
        if (status != KEMPE_OK && status != KEMPE_E_FAILED)
            return status;
        d->known[i] = status == KEMPE_OK;
    }
    if ((d->known[0] && d->known[1]) || (d->known[2] && d->known[3])) {
        kmp_context_clear(d->s->context);
        return KEMPE_OK;
    }
    return status == KEMPE_E_FAILED ? status
                                    : kmp_fail(d->s->context, KEMPE_E_FAILED,
                                               "the model does not run beside the value of '%s'", d->s->name[k]);
}

/* Derivatives by parameter k in the rows; the largest change of one over the largest derivative of its column. */
static double take_slopes(const differences *d, int k)
{
    const kempe_sensitivity *s = d->s;
    const double step = KMP_RUN_STEP * s->size[k];
    double error = 0;
    for (int c = 0; c < s->columns; c++) {
        double change = 0, most = 0;
        for (int row = 0; row < d->count; row++) {
            double rough, *slope = s->cell + (size_t)row * kmp_sensitivity_width(s) + s->columns + c * s->count + k;
            slope_of(d, (ptrdiff_t)row * s->columns + c, step, slope, &rough);
            change = fmax(change, fabs(*slope - rough));
            most = fmax(most, fabs(*slope));
        }
        error = most > 0 ? fmax(error, change / most) : error;
    }
    return error;
}

static kempe_status find_rows(differences *d, const double *values, double *error)
{
    kempe_sensitivity *s = d->s;
    KMP_TRY(run_at(d, values, d->cells));
    const kmp_run_report first = d->report;
    for (int row = 0; row < d->count; row++) {
        double *to = kmp_sensitivity_add_row(s, d->t[row]);
        KMP_TRY(kmp_made(s->context, to));
        memcpy(to, d->cells + (ptrdiff_t)row * s->columns, (size_t)s->columns * sizeof *to);
    }
    *error = 0;
    for (int k = 0; k < s->count; k++) {
        KMP_TRY(differ_by(d, values, k));
        *error = fmax(*error, take_slopes(d, k));
    }
    d->report = first;
    kmp_linear none = {0};
    return kmp_linear_vary(&none, s->system, s->variant, values);
}

kempe_status kmp_run_differences(kempe_sensitivity *s, const kmp_differing *options, const double *values,
                                 kmp_run_report *report)
{
    const kmp_run_spec *spec = options->spec;
    differences d = {.s = s, .words = options->words, .count = options->count, .t = options->t};
    size_t cells = (size_t)d.count * (size_t)s->columns;
    d.run = (kempe_run_options){.size = sizeof d.run,
                                .formulation = spec->formulation,
                                .form = spec->form,
                                .integrator = spec->integrator,
                                .backend = spec->backend,
                                .independent = options->independent,
                                .rtol = spec->rtol,
                                .atol = spec->atol,
                                .t_end = spec->t_end,
                                .output_step = spec->t_end,
                                .max_steps = spec->max_steps,
                                .no_convergence_check = 1,
                                .keep_dense = 1};
    bool made =
        KMP_ARENA_MAKE(&d.arena, KMP_ROOM(double, cells, &d.cells, &d.cell[0], &d.cell[1], &d.cell[2], &d.cell[3]),
                       KMP_ROOM(double, s->count, &d.values), KMP_ROOM(double, s->outputs.count, &d.row));
    kempe_status status = kmp_made(s->context, made);
    if (status == KEMPE_OK)
        status = find_rows(&d, values, &s->slope_error);
    *report = d.report;
    kmp_arena_free(&d.arena);
    return status;
}
