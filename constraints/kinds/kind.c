/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/kinds/kind.h"
#include <string.h>

static const kmp_closure_kind *const kinds[] = {
#define KMP_KIND(name) &kmp_kind_##name,
#include "constraints/kinds/kinds.def"
#undef KMP_KIND
};

int kmp_closure_rows(const kmp_closure_kind *kind, const kmp_closure *closure)
{
    return closure->curve_count > 0 ? closure->curve_count : kind->rows;
}

const kmp_closure_kind *kmp_closure_kind_find(const char *name)
{
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        if (strcmp(kinds[k]->name, name) == 0)
            return kinds[k];
    return NULL;
}
