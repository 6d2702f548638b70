/* SPDX-License-Identifier: BSD-3-Clause */
/* Losses of gears become friction before the model is read: along the path of the first pitch point, with a level for
 * each direction. The first wheel has the force lambda/e1 where it drives with the efficiency e1. It has e2 lambda
 * where the second wheel drives with e2. So self-locking pairs, whose e2 is not positive, have finite levels. */
#include "model/read/gear_losses.h"
#include "model/files/nodes.h"
#include "model/read/read_include.h"
#include <string.h>

/* The words for both efficiencies: one text, a list of two, or from the friction of a worm's thread with the lead
 * angle g and the pressure angle a: (cos a - mu tan g)/(cos a + mu/tan g) forwards, (cos a - mu/tan g)/(cos a + mu tan
 * g) backwards. NULL: there is no loss. */
static bool efficiency_words(kmp_reader *r, const kmp_yaml *gear, const char *words[2])
{
    const kmp_yaml *node = kmp_yaml_get(gear, "efficiency"), *friction = kmp_yaml_get(gear, "friction");
    const kmp_yaml *lead = kmp_yaml_get(gear, "lead_angle"), *angle = kmp_yaml_get(gear, "pressure_angle");
    const bool two = node && node->kind == KMP_YAML_LIST && node->count == 2;
    if (friction && lead && !node) {
        const char *a = angle && angle->text ? angle->text : "20 deg", *g = lead->text, *mu = friction->text;
        words[0] = kmp_reader_say(r, "((cos(%s) - (%s)*tan(%s))/(cos(%s) + (%s)/tan(%s)))", a, mu, g, a, mu, g);
        words[1] = kmp_reader_say(r, "((cos(%s) - (%s)/tan(%s))/(cos(%s) + (%s)*tan(%s)))", a, mu, g, a, mu, g);
        return mu && g;
    }
    for (int k = 0; k < 2; k++)
        words[k] = two ? node->items[k]->text : node && node->kind == KMP_YAML_SCALAR ? node->text : NULL;
    return words[0] && words[1];
}

/* The level against positive rates ('>') or negative ones. */
static const kmp_yaml *level_word(kmp_reader *r, const kmp_yaml *gear, const char *name, char sign,
                                  const char *const words[2])
{
    const char *text = kmp_reader_say(r, "if(lambda(%s) %c 0, 1/(%s) - 1, 1 - (%s))*abs(lambda(%s))", name, sign,
                                      words[0], words[1], name);
    return kmp_yaml_word(&r->scratch, gear->place, text);
}

static void add_loss(kmp_reader *r, const kmp_yaml *key, const kmp_yaml *gear, kmp_yaml *forces)
{
    const char *name = kmp_reader_own_name(r, key->place.file, key->text), *words[2];
    const char *own = kmp_reader_say(r, "%s_loss", key->text);
    kmp_arena *arena = &r->scratch;
    if (!efficiency_words(r, gear, words))
        return;
    if (kmp_yaml_get(forces, own)) {
        kmp_reader_complain(r, key->place, "gear '%s': the section forces has '%s', the name of its losses, already",
                            key->text, own);
        return;
    }
    kmp_yaml *entry = kmp_yaml_new(arena, KMP_YAML_MAP, gear->place);
    kmp_yaml *friction = kmp_yaml_new(arena, KMP_YAML_MAP, gear->place);
    kmp_yaml *levels = kmp_yaml_new(arena, KMP_YAML_LIST, gear->place);
    kmp_yaml_append(arena, levels, NULL, level_word(r, gear, name, '>', words));
    kmp_yaml_append(arena, levels, NULL, level_word(r, gear, name, '<', words));
    kmp_yaml_put(arena, friction, gear->place, "force", levels);
    kmp_yaml_put(arena, entry, gear->place, "sliding",
                 kmp_yaml_word(arena, gear->place, kmp_reader_say(r, "path(%s)", name)));
    kmp_yaml_put(arena, entry, gear->place, "friction", friction);
    kmp_yaml_put(arena, forces, gear->place, own, entry);
}

void kmp_read_gear_losses(kmp_reader *r)
{
    const kmp_yaml *gears = kmp_yaml_get(r->root, "gears"), *forces = kmp_yaml_get(r->root, "forces");
    const char *words[2];
    bool any = false;
    for (int k = 0; gears && gears->kind == KMP_YAML_MAP && k < gears->count; k++)
        any = any || (gears->items[k] && efficiency_words(r, gears->items[k], words));
    if (!any || (forces && forces->kind != KMP_YAML_MAP))
        return;
    kmp_yaml *root = kmp_yaml_copy(&r->scratch, r->root);
    kmp_yaml *more =
        forces ? kmp_yaml_copy(&r->scratch, forces) : kmp_yaml_new(&r->scratch, KMP_YAML_MAP, r->root->place);
    if (!root || !more)
        return;
    for (int k = 0; k < gears->count; k++)
        if (gears->items[k])
            add_loss(r, gears->keys[k], gears->items[k], more);
    for (int k = 0; forces && k < root->count; k++)
        root->items[k] = root->items[k] == forces ? more : root->items[k];
    if (!forces)
        kmp_yaml_put(&r->scratch, root, r->root->place, "forces", more);
    r->root = root;
}
