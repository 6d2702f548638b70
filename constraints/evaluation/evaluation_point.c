/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs of expressions at the state of an evaluator: the same conditions, charts and parameters, taken over when
 * they have changed, and outputs listed with their places. */
#include "constraints/evaluation/evaluation_point.h"
#include "base/memory.h"

kmp_instant kmp_instant_of(const kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                           const double *lambda)
{
    return (kmp_instant){
        t, q, qd, qdd, lambda, NULL, eval->conditions.mode, eval->chart, eval->chart_version, &eval->inputs};
}

/* -- outputs ----------------------------------------------------------------------------------------- */

int kmp_listing_add(kmp_listing *listing, kmp_ref r)
{
    kmp_ref *output = kmp_list_room(listing->output, (size_t)listing->output_count, sizeof *output);
    listing->output = output ? output : listing->output;
    listing->failed = listing->failed || !output;
    if (listing->failed)
        return -1;
    listing->output[listing->output_count] = r;
    return listing->output_count++;
}

void kmp_listing_place(kmp_listing *listing, int block, int row, int col, int source)
{
    if (source < 0)
        return;
    kmp_tangent *entry = kmp_list_room(listing->entry, (size_t)listing->count, sizeof *entry);
    listing->entry = entry ? entry : listing->entry;
    listing->failed = listing->failed || !entry;
    if (!listing->failed)
        listing->entry[listing->count++] = (kmp_tangent){block, row, col, source};
}

void kmp_listing_put(kmp_listing *listing, int block, int row, int col, kmp_ref r)
{
    if (r != KMP_ZERO)
        kmp_listing_place(listing, block, row, col, kmp_listing_add(listing, r));
}

/* -- programs ---------------------------------------------------------------------------------------- */

bool kmp_formulas_prepare(kmp_formulas *formulas, const kmp_backend *backend, const double *parameters)
{
    formulas->machine = formulas->program ? kmp_machine_new(formulas->program, backend) : NULL;
    if (formulas->machine)
        kmp_formulas_renew(formulas, parameters);
    return formulas->machine;
}

bool kmp_formulas_init(kmp_formulas *formulas, kmp_graph *graph, int count, const kmp_ref *output,
                       const kmp_backend *backend, const double *parameters)
{
    formulas->program = kmp_program_new(graph, 1, &count, &output);
    return kmp_formulas_prepare(formulas, backend, parameters);
}

KMP_CLEARS(kmp_formulas, formulas, kmp_machine_free(formulas->machine), kmp_program_free(formulas->program))

void kmp_formulas_renew(kmp_formulas *formulas, const double *parameters)
{
    kmp_machine_set(formulas->machine, KMP_IN_PARAMETER, parameters);
    formulas->charts = -1; /* stage 0 runs when the charts are known */
}

void kmp_formulas_place(kmp_formulas *formulas, const kmp_instant *at)
{
    kmp_machine *machine = formulas->machine;
    if (formulas->charts != at->chart_version) {
        kmp_machine_set(machine, KMP_IN_CHART, at->chart);
        (void)kmp_machine_run(machine, 0);
        formulas->charts = at->chart_version;
    }
    kmp_machine_set(machine, KMP_IN_TIME, kmp_instant_times(at));
    kmp_machine_set(machine, KMP_IN_Q, at->q);
    kmp_machine_set(machine, KMP_IN_QD, at->qd);
    kmp_machine_set(machine, KMP_IN_QDD, at->qdd);
    kmp_machine_set(machine, KMP_IN_LAMBDA, at->lambda);
    if (at->mode)
        kmp_machine_set(machine, KMP_IN_MODE, at->mode);
    if (at->mu)
        kmp_machine_set(machine, KMP_IN_MU, at->mu);
}

const double *kmp_formulas_at(kmp_formulas *formulas, const kmp_instant *at)
{
    kmp_formulas_place(formulas, at);
    return kmp_machine_run(formulas->machine, 1);
}
