/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/kinds/kind.h"
#include "base/wings.h"
#include <string.h>

const kmp_part kmp_part_none = {0};

static const kmp_closure_kind kinds[] = {
#define KMP_KIND(name, force, moment) {#name, &kmp_part_##force, &kmp_part_##moment},
#include "constraints/kinds/kinds.def"
#undef KMP_KIND
};

int kmp_closure_rows(const kmp_closure_kind *kind, const kmp_closure *closure)
{
    return closure->curve_count > 0 ? closure->curve_count : kind->force->rows + kind->moment->rows;
}

void kmp_closure_residual(const kmp_closure_kind *kind, const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kind->force->residual(tree, closure, h);
    if (kind->moment->rows > 0)
        kind->moment->residual(tree, closure, h + kind->force->rows);
}

bool kmp_closure_rates(const kmp_closure_kind *kind, const kmp_tree *tree, const kmp_closure *closure, kmp_ref *rates)
{
    return kind->force->rates && kind->force->rates(tree, closure, rates);
}

const kmp_closure_kind *kmp_closure_kind_find(const char *name)
{
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        if (strcmp(kinds[k].name, name) == 0)
            return &kinds[k];
    for (const kmp_wing *const *wing = kmp_wings; *wing; wing++)
        for (const kmp_closure_kind *kind = (*wing)->closures; kind && kind->name; kind++)
            if (strcmp(kind->name, name) == 0)
                return kind;
    return NULL;
}

bool kmp_closure_aligns(const kmp_closure_kind *kind)
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
    for (int c = 0; c < model->closure_count; c++) {
        const kmp_closure_kind *kind = kmp_closure_kind_find(model->closures[c].kind);
        rows += kind ? kmp_closure_rows(kind, &model->closures[c]) : 0;
    }
    return rows;
}
