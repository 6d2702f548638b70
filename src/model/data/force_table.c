/* SPDX-License-Identifier: BSD-3-Clause */
/* Look-ups in the table of forces: fields by key, their numbers and points, and rules between them. Readers, printers
 * and reports go through these rows, and know no kind of force. */
#include "model/data/force_table.h"
#include "model/data/body.h"
#include <stddef.h>
#include <string.h>

const kmp_force_row kmp_force_rows[KMP_FORCE_KINDS] = {
#define KMP_FORCE(kind, name, place, word, width) {#name, place, word, width},
#define KMP_FIELD(...)
#include "model/data/force_kinds.def"
#undef KMP_FORCE
#undef KMP_FIELD
};

const kmp_force_field kmp_force_fields[] = {
#define KMP_FORCE(kind, name, place, word, width)
#define KMP_FIELD(kind, member, key, size, effort, coordinate, time, required, rule, ...)                              \
    {KMP_FORCE_##kind, key, offsetof(kmp_force, member), size, effort, coordinate, time, required, KMP_FIELD_##rule},
#include "model/data/force_kinds.def"
#undef KMP_FORCE
#undef KMP_FIELD
};

const int kmp_force_field_count = sizeof kmp_force_fields / sizeof kmp_force_fields[0];

bool kmp_field_fits(kmp_field_rule rule, double value)
{
    return rule == KMP_FIELD_ANY || value > 0 || (rule == KMP_FIELD_NOT_NEGATIVE && !(value < 0));
}

const char *kmp_field_rule_words(kmp_field_rule rule)
{
    return rule == KMP_FIELD_POSITIVE ? "be positive" : "not be negative";
}

kmp_number *kmp_force_number(kmp_force *force, int field)
{
    return (kmp_number *)(void *)((char *)force + kmp_force_fields[field].offset);
}

const kmp_number *kmp_force_get(const kmp_force *force, int field)
{
    return (const kmp_number *)(const void *)((const char *)force + kmp_force_fields[field].offset);
}

const char *kmp_force_key(const kempe_model *model, const kmp_force *force, const char *key)
{
    if (!key || strcmp(key, "effort") != 0)
        return key;
    bool turns = force->motion >= 0 ? kmp_model_motion(model, force->motion)->rotation : force->turns;
    return turns ? "torque" : "force";
}

bool kmp_force_is_between(kmp_force_kind kind)
{
    static const char *const others[] = {"joint", "at", "on", "sliding", "wheel", "tyre", "contact", "state"};
    return kmp_name_find(KMP_NAMES_OF(others), kmp_force_rows[kind].place) < 0;
}

int kmp_force_point(const kmp_force *force, int k)
{
    return k == 0 ? force->point[0] : k > force->through_count ? force->point[1] : force->through[k - 1];
}

bool kmp_force_is_line(kmp_force_kind kind)
{
    return kind == KMP_FORCE_SPRING || kind == KMP_FORCE_LINE || kind == KMP_FORCE_CYLINDER;
}

bool kmp_force_has_components(const kmp_force *force)
{
    return force->kind == KMP_FORCE_POINT || force->kind == KMP_FORCE_BODY;
}

bool kmp_force_has(const kmp_force *force, int field)
{
    const kmp_number *number = kmp_force_get(force, field);
    if (force->matrix)
        return number == force->preload;
    if (force->kind == KMP_FORCE_TOUCH || force->kind == KMP_FORCE_COMPLIANT)
        return number == &force->restitution ||
               (number == &force->touch.limit ? force->touch.motion >= 0 : number->value > 0);
    if (force->kind == KMP_FORCE_FRICTION)
        return !(number == &force->speed && !force->has_speed) &&
               !(number == &force->regularise && !force->has_regularise) &&
               !(number == &force->level && force->effort) && number != &force->mu && number != &force->mu_static &&
               number != &force->radius && number != &force->flank &&
               !(number == &force->holding && (!force->has_static || force->holding_effort));
    return !(number == &force->lower && !force->has_lower) && !(number == &force->upper && !force->has_upper);
}
