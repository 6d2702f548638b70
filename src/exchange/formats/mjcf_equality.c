/* SPDX-License-Identifier: BSD-3-Clause */
/* Equalities of MJCF as closures. An equality without positions keeps those of the file: the
 * frames of the bodies at the reference coordinates. */
#include "exchange/formats/mjcf_equality.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/importing.h"
#include "exchange/formats/mjcf.h"
#include "exchange/formats/mjcf_bodies.h"
#include "exchange/formats/mjcf_defaults.h"
#include "exchange/formats/mjcf_tendons.h"
#include <string.h>

static const char *equality_name(kmp_mjcf *m, const kmp_element *e, int number)
{
    const char *name = kmp_element_text(e, "name");
    return name ? kmp_import_clean(m->im, name) : kmp_arena_printf(m->im->arena, "%s_%d", e->name, number);
}

/* -- two bodies ---------------------------------------------------------------------------------------- */

static const kmp_mjcf_body *body_of(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key)
{
    const char *name = kmp_mjcf_text(item, key);
    if (!name && strcmp(key, "body2") == 0)
        return &m->world;
    if (!name)
        kmp_import_complain(m->im, item->own->place, "attribute", key, "is missing here");
    return name ? kmp_mjcf_body_of(m, item->own, name) : NULL;
}

static const char *site_of(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key)
{
    const char *name = kmp_mjcf_text(item, key);
    const kmp_mjcf_site *s = name ? m->sites : NULL;
    while (s && strcmp(s->name, name) != 0)
        s = s->next;
    if (!name)
        kmp_import_complain(m->im, item->own->place, "attribute", key, "is missing here");
    else if (!s)
        kmp_import_complain(m->im, item->own->place, "the site", name, "does not exist");
    return s ? s->point : NULL;
}

/* The frames in both bodies that a connect or weld makes one. */
static void meet(kmp_mjcf *m, const kmp_mjcf_item *item, const kmp_mjcf_body *const body[2], kmp_pose frame[2])
{
    bool connects = strcmp(item->own->name, "connect") == 0;
    double anchor[3] = {0}, given[7] = {0};
    const kmp_pose back[2] = {kmp_frame_inverse(&body[0]->world), kmp_frame_inverse(&body[1]->world)};
    kmp_pose at = kmp_frame_none(), second = kmp_frame_in(&back[0], &body[1]->world);
    if (kmp_mjcf_numbers(m, item, "anchor", 3, 3, anchor) == 0 && connects)
        kmp_import_complain(m->im, item->own->place, "attribute", "anchor", "is missing here");
    memcpy(at.p, anchor, sizeof at.p);
    if (connects) {
        const kmp_pose world = kmp_frame_in(&body[0]->world, &at);
        frame[0] = at;
        frame[1] = kmp_frame_in(&back[1], &world);
        memcpy(frame[1].r, kmp_frame_none().r, sizeof frame[1].r);
        return;
    }
    frame[0] = kmp_frame_in(&second, &at);
    frame[1] = at;
    if (kmp_mjcf_numbers(m, item, "relpose", 7, 7, given) && kmp_frame_turn(given + 3, frame[0].r))
        memcpy(frame[0].p, given, sizeof frame[0].p); /* of the anchor */
}

static void add_pair(kmp_mjcf *m, const kmp_mjcf_item *item, const char *name)
{
    kmp_import *im = m->im;
    bool connects = strcmp(item->own->name, "connect") == 0;
    const char *points[2];
    if (kmp_mjcf_text(item, "site1") || kmp_mjcf_text(item, "site2")) {
        points[0] = site_of(m, item, "site1");
        points[1] = site_of(m, item, "site2");
    } else {
        const kmp_mjcf_body *body[2] = {body_of(m, item, "body1"), body_of(m, item, "body2")};
        kmp_pose frame[2];
        if (!body[0] || !body[1])
            return;
        meet(m, item, body, frame);
        for (int k = 0; k < 2; k++)
            points[k] = kmp_import_point(im, item->own->place, body[k]->own, name, &frame[k]);
    }
    if (points[0] && points[1])
        kmp_import_loop(im, item->own, name, connects ? "ball" : "weld", points, NULL);
}

/* -- coordinates --------------------------------------------------------------------------------------- */

/* y - y0 = a0 + a1 d + a2 d^2 + .., d = x - x0, by Horner's rule; without x the value of y is constant. */
static void add_polynomial(kmp_mjcf *m, const kmp_element *e, const char *name, const kmp_mjcf_form *y,
                           const kmp_mjcf_form *x, const double a[5])
{
    kmp_import *im = m->im;
    kmp_text text = {0};
    kmp_yaml *map = kmp_import_map(im, e->place);
    kmp_mjcf_put_form(&text, y, "q");
    kmp_text_printf(&text, " - (%.17g)", y->reference + a[0]);
    int most = x->count > 0 ? 4 : 0;
    while (most > 0 && a[most] == 0)
        most--;
    for (int k = 1; k <= most; k++) {
        kmp_text_printf(&text, " %s (", k == 1 ? "-" : "+");
        kmp_mjcf_put_form(&text, x, "q");
        kmp_text_printf(&text, " - (%.17g))*(%.17g", x->reference, a[k]);
    }
    for (int k = 0; k < most; k++)
        kmp_text_put(&text, ")");
    kmp_import_word(im, map, e->place, "constraint", kmp_text_keep(&text, im->arena));
    kmp_import_word(im, map, e->place, "power", y->slides ? "1" : "0");
    kmp_import_add(im, "loops", e, name, map);
}

static void add_relation(kmp_mjcf *m, const kmp_mjcf_item *item, const char *name)
{
    bool joints = strcmp(item->own->name, "joint") == 0;
    static const char *const keys[2][2] = {{"tendon1", "tendon2"}, {"joint1", "joint2"}};
    double a[5] = {0, 1, 0, 0, 0};
    kmp_mjcf_form forms[2] = {{.count = 0}};
    for (int k = 0; k < 2; k++) {
        const char *word = kmp_mjcf_text(item, keys[joints][k]);
        if (!word && k == 0)
            kmp_import_complain(m->im, item->own->place, "attribute", keys[joints][k], "is missing here");
        else if (word && joints)
            kmp_mjcf_add_joint(m, &forms[k], item->own, word, 1);
        else if (word)
            kmp_mjcf_add_tendon(m, &forms[k], item->own, word);
    }
    kmp_mjcf_form *y = &forms[0], *x = &forms[1];
    kmp_mjcf_numbers(m, item, "polycoef", 1, 5, a);
    if (y->count == 0)
        return;
    if (x->count == 0 ? y->count == 1 : a[2] != 0 || a[3] != 0 || a[4] != 0) {
        add_polynomial(m, item->own, name, y, x, a);
        return;
    }
    for (int k = 0; k < x->count; k++)
        kmp_mjcf_add_term(m, y, x->joint[k], -a[1] * x->factor[k]);
    kmp_import_coupler(m->im, item->own, name, y->count, y->joint, y->factor,
                       y->reference + a[0] - (x->count > 0 ? a[1] * x->reference : 0));
}

void kmp_mjcf_add_equalities(kmp_mjcf *m)
{
    int number = 0;
    for (const kmp_element *section = kmp_element_find(m->im->model, "equality"); section && m->has_equalities;
         section = kmp_element_again(section))
        for (const kmp_element *e = section->first; e; e = e->next) {
            bool pair = strcmp(e->name, "connect") == 0 || strcmp(e->name, "weld") == 0;
            if (!pair && strcmp(e->name, "joint") != 0 && strcmp(e->name, "tendon") != 0)
                continue;
            kmp_mjcf_item item = kmp_mjcf_take(m, e, "equality", NULL);
            const char *name = equality_name(m, e, ++number);
            if (kmp_mjcf_flag(m, &item, "active", true))
                (pair ? add_pair : add_relation)(m, &item, name);
        }
}
