/* SPDX-License-Identifier: BSD-3-Clause */
/* From a rounded drawing to a system: assemble, look whether closures are redundant but for rounding, find the nearest
 * mechanism in which they are exactly so, and derive its equations; or take the closures as written where rounding does
 * not explain their gaps. */
#include "constraints/inexact/nearest_exact.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/inexact/exact_geometry.h"
#include "constraints/tolerances.h"
#include "dynamics/program_cache.h"
#include "dynamics/system_record.h"
#include "model/data/model.h"
#include <kempe/check.h>
#include <kempe/settings.h>
#include <math.h>

/* Bounds for the search: in larger models closures that are redundant but for rounding stay open. */
enum { MOST_COORDINATES = 100, MOST_ROWS = 200 };

/* The closures of a model alone, assembled, and the exact mechanism of the drawing. */
typedef struct meaning {
    kempe_system *closures;
    kempe_assembly *a;
    bool rounded;
    kmp_drawn_model drawing;
    kmp_variant *variant; /* its model has the numbers of an exact mechanism */
    double by;            /* the largest shift, scaled */
} meaning;

/* Assembles at the start; *rounded: closures are redundant but for rounding of the model's numbers. */
static kempe_status assemble_first(kempe_system *s, kempe_assembly **a, bool *rounded)
{
    bool looked = s->m > 0 && s->closure_tolerance > 0;
    kempe_status status = looked ? kmp_assemble_start(s, a) : KEMPE_OK;
    *rounded = looked && status == KEMPE_OK && (*a)->closed && kmp_rounding_of(s);
    kmp_context_clear(s->context);
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(s->context) : KEMPE_OK;
}

/* Looks for an exact mechanism if the closures are rounded and not too many. `given`: the variant that owns the model,
 * NULL: one is made. */
static kempe_status find_meaning(const kempe_model *model, kmp_variant *given, meaning *x)
{
    *x = (meaning){.variant = given};
    KMP_TRY(kmp_system_of_closures(model, &x->closures));
    KMP_TRY(assemble_first(x->closures, &x->a, &x->rounded));
    if (!x->rounded || x->closures->n > MOST_COORDINATES || x->closures->m > MOST_ROWS)
        return KEMPE_OK;
    if (!given)
        KMP_TRY(kmp_variant_new(model, 0, NULL, &x->variant));
    return kmp_exact_find(x->closures, x->a, x->variant, &x->drawing, &x->by);
}

/* Frees all except the given variant. */
static void end_meaning(meaning *x, const kmp_variant *given)
{
    if (x->variant != given)
        kmp_variant_free(x->variant);
    kempe_assembly_free(x->a);
    kempe_system_free(x->closures);
}

kempe_status kmp_meant(const kempe_model *model, kmp_variant **meant)
{
    meaning x;
    kempe_status status = find_meaning(model, NULL, &x);
    *meant = status == KEMPE_OK && x.drawing == KMP_DRAWING_EXACT ? x.variant : NULL;
    end_meaning(&x, *meant);
    return status;
}

/* -- systems ----------------------------------------------------------------------------------------- */

/* Records in a system of the same drawing the gaps as drawn, at the start or else elsewhere. */
static void note_misfits(const kempe_system *rounded, const kempe_assembly *a, kempe_system *s)
{
    for (int c = 0; c < rounded->model->closure_count; c++)
        s->misfit[c] = rounded->misfit[c];
    for (int r = 0; r < rounded->m; r++) {
        double *most = &s->misfit[rounded->rows[r].closure];
        double open = a->misfit > KMP_CLOSED_ENOUGH ? a->open[r] : rounded->rounding->misfit;
        *most = a->dropped[r] && open > KMP_CLOSED_ENOUGH ? fmax(*most, open) : *most;
    }
}

void kmp_put_misfit(kmp_text *text, const kempe_system *s, int closure)
{
    if (!(s->misfit[closure] > 0))
        return;
    kmp_text_printf(text,
                    "closure '%s' has a gap of %.2g m as drawn: accepted as rounding of the model's numbers "
                    "(closure_tolerance %.2g m)",
                    s->model->closures[closure].name, s->misfit[closure] * s->length, s->closure_tolerance);
    if (s->mended)
        kmp_text_printf(text, "; it closes if points and axes move by at most %.2g of the length of %.3g m",
                        s->mended_by, s->length);
}

/* Replaces a rounded system by that of the exact mechanism. If rounding does not explain the misfit, the closures hold
 * as written. The closures alone decide, as in kmp_meant, so that both give the same bits. */
static kempe_status settle_meaning(kempe_system **system, kmp_variant *given, const char *word)
{
    kempe_system *s = *system;
    meaning x;
    kempe_status status = find_meaning(s->model, given, &x);
    bool exact = status == KEMPE_OK && x.drawing == KMP_DRAWING_EXACT;
    if (exact)
        status = kmp_system_new_by(kmp_variant_model(x.variant), word, system);
    if (exact && status == KEMPE_OK) {
        (*system)->mended = true;
        (*system)->mended_by = x.by;
        (*system)->build_s += s->build_s;
        (*system)->own = given ? NULL : x.variant;
        x.variant = given;
        kempe_system_free(s);
    }
    if (status == KEMPE_OK && x.drawing == KMP_DRAWING_UNEXPLAINED) {
        s->strict = true;
        atomic_store(&s->rounding->state, KMP_ROUNDING_UNKNOWN);
    } else if (status == KEMPE_OK && x.rounded) {
        note_misfits(x.closures, x.a, *system);
    }
    end_meaning(&x, given);
    return status;
}

/* Derives a system. `given`: the variant that owns the model, if its parameters vary. */
static kempe_status derive_system(const kempe_model *model, kmp_variant *given, const char *word, kempe_system **system)
{
    kempe_system *s = NULL;
    kempe_assembly *a = NULL;
    bool rounded = false;
    kempe_status status = kmp_system_new_by(model, word, &s);
    if (status == KEMPE_OK)
        status = assemble_first(s, &a, &rounded);
    kempe_assembly_free(a);
    if (status == KEMPE_OK && rounded)
        status = settle_meaning(&s, given, word);
    else if (status == KEMPE_OK && !given && !kmp_rounding_of(s)) {
        kmp_program_cache_set_key(s, word);
        kmp_system_keep(s);
    }
    return KMP_GIVE_OR_FREE(status, system, s, kempe_system_free);
}

/* Reports the gaps as drawn, and that a mended system closes them. */
static void report_misfits(const kempe_system *s)
{
    for (int c = 0; c < s->model->closure_count; c++) {
        kmp_text text = {0};
        kmp_put_misfit(&text, s, c);
        if (text.s && text.length > 0)
            kmp_log(s->context, KEMPE_LOG_WARNING, "%s", text.s);
        kmp_text_free(&text);
    }
}

static kempe_status new_system(const kempe_model *model, kmp_variant *given, const char *word, kempe_system **system)
{
    kempe_system *s = given ? NULL : kmp_system_recall(model, word);
    if (s)
        kmp_context_clear(model->context);
    else
        KMP_TRY(derive_system(model, given, word, &s));
    report_misfits(s);
    *system = s;
    return KEMPE_OK;
}

kempe_status kmp_system_new(const kempe_model *model, const char *word, kempe_system **system)
{
    return new_system(model, NULL, word, system);
}

kempe_status kmp_system_of_variant(kmp_variant *variant, kempe_system **system)
{
    return new_system(kmp_variant_model(variant), variant, NULL, system);
}

kempe_status kempe_system_new_with_algorithm(const kempe_model *model, const char *word, kempe_system **system)
{
    KMP_WANTED_BOTH(model, system);
    return kmp_system_new(model, word, system);
}
