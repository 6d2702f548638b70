/* SPDX-License-Identifier: BSD-3-Clause */
/* Kinds of closures as rows of a table of parts, completed by the rows of the wings: a kind with two parts has the rows
 * of the first, then the rows of the second. */
#include "constraints/kinds/kind.h"
#include "base/wings.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/closure.h"
#include "model/data/gear.h"

const kmp_part kmp_part_none = {0};

static const kmp_closure_parts parts[KMP_CLOSURE_KINDS] = {
    {NULL, NULL},
#define KMP_CLOSURE(name, needs, force, moment, ...) {&kmp_part_##force, &kmp_part_##moment},
#define KMP_INNER_CLOSURE                            KMP_CLOSURE
#define KMP_CLOSURE_OF_WING(...)                     {NULL, NULL},
#include "model/data/closure_kinds.def"
#undef KMP_CLOSURE
};

int kmp_closure_rows(const kmp_closure_parts *kind, const kmp_closure *closure)
{
    if (closure->gear && !closure->gear->rigid)
        return 0;
    return closure->curve_count > 0 ? closure->curve_count : kind->force->rows + kind->moment->rows;
}

void kmp_closure_residual(const kmp_closure_parts *kind, const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    if (kind->force->rows > 0)
        kind->force->residual(tree, closure, h);
    if (kind->moment->rows > 0)
        kind->moment->residual(tree, closure, h + kind->force->rows);
}

bool kmp_closure_rates(const kmp_closure_parts *kind, const kmp_tree *tree, const kmp_closure *closure, kmp_ref *rates)
{
    return kind->force->rates && kind->force->rates(tree, closure, rates);
}

const kmp_closure_parts *kmp_closure_parts_of(kmp_closure_kind kind)
{
    if (kind <= KMP_CLOSURE_NONE || kind >= KMP_CLOSURE_KINDS)
        return NULL;
    for (const kmp_wing *const *wing = kmp_wings; *wing && !parts[kind].force; wing++)
        for (const kmp_closure_of_wing *row = (*wing)->closures; row && row->parts.force; row++)
            if (row->kind == kind)
                return &row->parts;
    return parts[kind].force ? &parts[kind] : NULL;
}

bool kmp_closure_aligns(const kmp_closure_parts *kind)
{
    return kind && kind->moment == &kmp_part_aligned;
}

kmp_vec kmp_part_effort(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    (void)tree, (void)closure;
    return (kmp_vec){{lambda[0], KMP_ZERO, KMP_ZERO}};
}

int kmp_closure_all_rows(const kempe_model *model)
{
    int rows = 0;
    for (int c = 0; c < kmp_model_closure_count(model); c++) {
        const kmp_closure *closure = kmp_model_closure(model, c);
        const kmp_closure_parts *kind = kmp_closure_parts_of(closure->kind);
        rows += kind ? kmp_closure_rows(kind, closure) : 0;
    }
    return rows;
}
