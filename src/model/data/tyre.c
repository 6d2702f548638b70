/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/tyre.h"
#include "model/data/model.h"
#include <string.h>

void kmp_tyre_put_form(kmp_text *text, const kmp_tyre *tyre)
{
    kmp_text_printf(text, "%s by the equations of %s, pure lateral force over %s, vertical force Cz rho + Kz rho'",
                    tyre->file, tyre->form == KMP_TYRE_MF61 ? "MF 6.1 without pressure" : "PAC2002 and MF 5.2",
                    tyre->tangent ? "tan(alpha)" : "alpha");
}

static bool is_alike(const kmp_tyre *a, const kmp_tyre *b)
{
    return b->tir && a->form == b->form && a->tangent == b->tangent && strcmp(a->file, b->file) == 0;
}

bool kmp_tyres_put_forms(kmp_text *text, const kempe_model *model, int *next)
{
    const kmp_tyre *end = model->tyres + model->tyre_count;
    for (const kmp_tyre *tyre = model->tyres + *next; tyre < end; tyre++) {
        bool known = !tyre->tir;
        for (const kmp_tyre *other = model->tyres; other < tyre; other++)
            known = known || is_alike(tyre, other);
        *next = (int)(tyre - model->tyres) + 1;
        if (known)
            continue;
        kmp_text_put(text, tyre->name);
        for (const kmp_tyre *other = tyre + 1; other < end; other++)
            if (is_alike(tyre, other))
                kmp_text_printf(text, ", %s", other->name);
        kmp_text_put(text, ": ");
        kmp_tyre_put_form(text, tyre);
        return true;
    }
    return false;
}
