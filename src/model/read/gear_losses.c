/* SPDX-License-Identifier: BSD-3-Clause */
/* Losses of gears become friction, and stiffness and backlash become contacts of both flanks, before the model is read.
 * Friction acts along the path of the first pitch point, with a level for each direction. The first wheel has the force
 * lambda/e1 where it drives with the efficiency e1. It has e2 lambda where the second wheel drives with e2. So
 * self-locking pairs, whose e2 is not positive, have finite levels. */
#include "model/read/gear_losses.h"
#include "model/files/nodes.h"
#include "model/read/read_include.h"

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

/* Adds the entry of a part of a gear to a section that has no other one of its name. */
static void add_entry(kmp_reader *r, const kmp_yaml *key, const char *section, const char *part, const char *name,
                      const kmp_yaml *entry, kmp_yaml *map)
{
    if (kmp_yaml_get(map, name))
        kmp_reader_complain(r, key->place, "gear '%s': the section %s has '%s', the name of its %s, already", key->text,
                            section, name, part);
    else
        kmp_yaml_put(&r->scratch, map, entry->place, name, entry);
}

static void add_loss(kmp_reader *r, const kmp_yaml *key, const kmp_yaml *gear, kmp_yaml *forces)
{
    const char *name = kmp_reader_own_name(r, key->place.file, key->text), *words[2];
    kmp_arena *arena = &r->scratch;
    if (!efficiency_words(r, gear, words))
        return;
    kmp_yaml *entry = kmp_yaml_new(arena, KMP_YAML_MAP, gear->place);
    kmp_yaml *friction = kmp_yaml_new(arena, KMP_YAML_MAP, gear->place);
    kmp_yaml *levels = kmp_yaml_new(arena, KMP_YAML_LIST, gear->place);
    for (int k = 0; k < 2; k++) { /* against positive rates, and against negative ones */
        const char *level = kmp_reader_say(r, "if(lambda(%s) %c 0, 1/(%s) - 1, 1 - (%s))*abs(lambda(%s))", name,
                                           "><"[k], words[0], words[1], name);
        kmp_yaml_append(arena, levels, NULL, kmp_yaml_word(arena, gear->place, level));
    }
    kmp_yaml_put(arena, friction, gear->place, "force", levels);
    kmp_yaml_put_word(arena, entry, gear->place, "sliding", kmp_reader_say(r, "path(%s)", name));
    kmp_yaml_put(arena, entry, gear->place, "friction", friction);
    if (entry)
        add_entry(r, key, "forces", "losses", kmp_reader_say(r, "%s_loss", key->text), entry, forces);
}

/* An entry of a flank: the gap is half of the backlash less the transmission error, or more it. */
static void add_flank(kmp_reader *r, const kmp_yaml *key, const kmp_yaml *gear, const char *flank, char sign,
                      kmp_yaml *contacts)
{
    static const char *const keys[] = {"stiffness", "damping", "restitution"};
    const char *name = kmp_reader_own_name(r, key->place.file, key->text);
    const kmp_yaml *backlash = kmp_yaml_get(gear, "backlash"), *stiffness = kmp_yaml_get(gear, "stiffness");
    kmp_arena *arena = &r->scratch;
    kmp_yaml *entry = kmp_yaml_new(arena, KMP_YAML_MAP, gear->place);
    const char *gap = backlash && backlash->text
                          ? kmp_reader_say(r, "(%s)/2 %c transmission_error(%s)", backlash->text, sign, name)
                          : kmp_reader_say(r, "0 m %c transmission_error(%s)", sign, name);
    kmp_yaml_put_word(arena, entry, gear->place, "gap", gap);
    kmp_yaml_put_word(arena, entry, gear->place, "law", stiffness ? "kelvin_voigt" : NULL);
    for (int k = 0; k < 3; k++) {
        const kmp_yaml *given = kmp_yaml_get(gear, keys[k]);
        kmp_yaml_put(arena, entry, gear->place, keys[k], given);
        if (!given && k == (stiffness ? 1 : 2))
            kmp_yaml_put_word(arena, entry, gear->place, keys[k], "0");
    }
    if (entry)
        add_entry(r, key, "contacts", "flank", kmp_reader_say(r, "%s_%s", key->text, flank), entry, contacts);
}

void kmp_read_gear_losses(kmp_reader *r)
{
    const kmp_yaml *gears = kmp_yaml_get(r->root, "gears");
    const char *words[2];
    kmp_yaml *root = NULL, *forces = NULL, *contacts = NULL;
    for (int k = 0; gears && gears->kind == KMP_YAML_MAP && k < gears->count; k++) {
        const kmp_yaml *gear = gears->items[k];
        const bool loses = gear && efficiency_words(r, gear, words),
                   plays = kmp_yaml_get(gear, "stiffness") || kmp_yaml_get(gear, "backlash");
        if (!root && (loses || plays))
            root = kmp_yaml_copy(&r->scratch, r->root);
        if (root && loses && !forces)
            forces = kmp_yaml_open(&r->scratch, root, "forces");
        if (root && plays && !contacts)
            contacts = kmp_yaml_open(&r->scratch, root, "contacts");
        if (loses && forces)
            add_loss(r, gears->keys[k], gear, forces);
        if (plays && contacts) {
            add_flank(r, gears->keys[k], gear, "front", '-', contacts);
            add_flank(r, gears->keys[k], gear, "back", '+', contacts);
        }
    }
    r->root = root ? root : r->root;
}
