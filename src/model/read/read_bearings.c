/* SPDX-License-Identifier: BSD-3-Clause */
/* The section `bearings`: two bearings on one pin, by the joint whose load they share. */
#include "model/read/read_bearings.h"
#include "model/data/bearing_pair.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/read/read_include.h"
#include "model/read/read_values.h"

static const kmp_key bearing_keys[] = {
#include "model/keys/bearing_keys.def"
    {0}};

/* The joint of the tree, the cut joint or the loop. */
static void read_joint(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_bearing_pair *pair)
{
    const kempe_model *model = r->model;
    const char *word = kmp_read_word(r, node, what);
    const char *name = word ? kmp_reader_name(r, node->place.file, word) : NULL;
    if (!name)
        return;
    pair->closure = kmp_name_find(KMP_NAMED(model, closure), name);
    pair->body = pair->closure < 0 ? kmp_joint_find(model, name) : 0;
    if (pair->closure >= 0) {
        const kmp_closure_kind kind = model->closures[pair->closure].kind;
        pair->joint = model->closures[pair->closure].name;
        if (kind != KMP_CLOSURE_revolute && kind != KMP_CLOSURE_cylindrical)
            kmp_complain_of(r, node, what, "'%s' is not a pin: the joint of two bearings is revolute or cylindrical",
                            word);
        return;
    }
    if (pair->body < 0) {
        kmp_nearest nearest = kmp_nearest_of(
            word, (kmp_name_list){&model->bodies[1].joint, sizeof *model->bodies, model->body_count - 1});
        kmp_nearest_offer_all(&nearest, KMP_NAMED(model, closure));
        kmp_reader_complain_unknown(r, node->place, &nearest, "%s: unknown joint '%s'", what, word);
        pair->body = 0;
        return;
    }
    pair->joint = model->bodies[pair->body].joint;
    if (kmp_pin_motion(model, pair->body) < 0)
        kmp_complain_of(r, node, what, "'%s' is not a pin: the joint of two bearings is revolute or cylindrical", word);
}

static void read_places(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_bearing_pair *pair)
{
    const char *of = kmp_reader_say(r, "%s: at", what);
    if (!kmp_read_list(r, node, of, 2))
        return;
    bool good = true;
    for (int k = 0; k < 2; k++)
        good = kmp_read_number(r, node->items[k], of, kmp_key_dimension(bearing_keys, "at"), &pair->at[k]) && good;
    if (good && pair->at[0].value == pair->at[1].value)
        kmp_complain_of(r, node, what, "both bearings are at %g m: their places must differ", pair->at[0].value);
}

static void read_thrust(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_bearing_pair *pair)
{
    static const char *const words[] = {"1", "2"};
    const bool slides = pair->joint && kmp_pin_slides(r->model, pair);
    pair->thrust = slides ? 0 : 1;
    if (!node)
        return;
    if (slides)
        kmp_complain_of(r, node, what,
                        "the joint slides along its axis and carries nothing along it: leave out 'thrust'");
    else
        pair->thrust = 1 + kmp_read_choice(r, node, what, KMP_NAMES_OF(words), "thrust is");
}

/* One exponent for both bearings, or a list of one for each. */
static void read_life(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_bearing_pair *pair)
{
    const char *of = kmp_reader_say(r, "%s: life", what);
    const bool each = node && node->kind == KMP_YAML_LIST;
    (void)kmp_key_default(bearing_keys, "life", 1, pair->life);
    pair->life[1] = pair->life[0];
    if (!node || (each && !kmp_read_list(r, node, of, 2)))
        return;
    for (int k = 0; k < 2; k++) {
        const kmp_yaml *item = each ? node->items[k] : node;
        if (k == 1 && !each)
            pair->life[1] = pair->life[0];
        else if (kmp_read_fixed(r, item, of, KMP_DIM_NUMBER, &pair->life[k]) && !(pair->life[k] >= 1))
            kmp_reader_complain(r, item->place, "%s is %g: it must be at least 1, and is 3 of balls, 10/3 of rollers",
                                of, pair->life[k]);
    }
}

void kmp_read_bearings(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "bearings", "bearings");
    model->bearings = KMP_ARENA_NEW(&model->arena, kmp_bearing_pair, s.count);
    while (model->bearings && kmp_section_next(&s)) {
        kmp_bearing_pair *pair = &model->bearings[model->bearing_count++];
        *pair = (kmp_bearing_pair){.name = s.name, .place = s.key->place, .closure = -1};
        if (!kmp_read_map(r, s.node, s.what, bearing_keys))
            continue;
        const kmp_yaml *joint = kmp_read_required(r, s.node, s.what, "joint");
        const kmp_yaml *at = kmp_read_required(r, s.node, s.what, "at");
        if (joint)
            read_joint(r, joint, s.what, pair);
        if (at)
            read_places(r, at, s.what, pair);
        read_thrust(r, kmp_yaml_get(s.node, "thrust"), s.what, pair);
        read_life(r, kmp_yaml_get(s.node, "life"), s.what, pair);
    }
}
