/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/formats/drake_tags.h"
#include "exchange/formats/importing.h"
#include <string.h>

/* The constraints and forces: the element, the prefix of its parts, the words of its two frames. */
static const struct {
    const char *tag, *parts, *frames[2];
} tags[] = {{"drake:ball_constraint", "drake:ball_constraint_", {"body_A", "body_B"}},
            {"drake:distance_constraint", "drake:distance_constraint_", {"body_A", "body_B"}},
            {"drake:linear_spring_damper", "drake:linear_spring_damper_", {"body_A", "body_B"}},
            {"drake:linear_bushing_rpy", "drake:bushing_", {"frameA", "frameC"}}};

enum { BALL, DISTANCE, SPRING, BUSHING, TAGS };

typedef struct tag {
    kmp_import *im;
    const kmp_element *e;
    const char *parts;
} tag;

static const kmp_element *part_of(const tag *t, const char *word)
{
    const char *key = kmp_arena_printf(t->im->arena, "%s%s", t->parts, word);
    return key ? kmp_element_find(t->e, key) : NULL;
}

static bool has(const tag *t, const char *word)
{
    return part_of(t, word) != NULL;
}

/* The numbers of a part, as many as there must be. */
static void read(const tag *t, const char *word, int count, double *values)
{
    const kmp_element *part = part_of(t, word);
    if (!part)
        kmp_import_complain(t->im, t->e->place, "element", kmp_arena_printf(t->im->arena, "%s%s", t->parts, word),
                            "is missing here");
    else if (part->text[0])
        kmp_import_read_numbers(t->im, t->e, part->name, count, count, values);
    else if (kmp_import_attribute(t->im, part, "value"))
        kmp_import_read_numbers(t->im, part, "value", count, count, values);
}

static double number(const tag *t, const char *word)
{
    double value = 0;
    read(t, word, 1, &value);
    return value;
}

static void put_number(const tag *t, kmp_yaml *map, const char *key, double value)
{
    kmp_import_value(t->im, map, t->e->place, key, value);
}

static void put_three(const tag *t, kmp_yaml *map, const char *key, const char *word)
{
    double values[3] = {0};
    read(t, word, 3, values);
    kmp_import_vector(t->im, map, t->e->place, key, values);
}

/* A spring between two points; a distance without stiffness is a rod. */
static void add(const tag *t, int kind, const char *name, const char *const points[2])
{
    kmp_import *im = t->im;
    bool rod = kind == DISTANCE && !has(t, "stiffness");
    const char *words[TAGS] = {
        [BALL] = "ball", [DISTANCE] = rod ? "rod" : "spring", [SPRING] = "spring", [BUSHING] = "bushing"};
    kmp_yaml *map = kmp_import_between(im, t->e, kind == BALL || rod ? "loops" : "forces", name, words[kind], points);
    if (rod)
        put_number(t, map, "length", number(t, "distance"));
    else if (kind == BUSHING) {
        put_three(t, map, "stiffness", "force_stiffness");
        put_three(t, map, "damping", "force_damping");
        put_three(t, map, "rotational_stiffness", "torque_stiffness");
        put_three(t, map, "rotational_damping", "torque_damping");
        kmp_import_leave_out(im, t->e->place, KMP_PART_AT_TIMES, t->e->name,
                             "'%s' is a bushing with the law of Kempe, which has no angles of roll, pitch and yaw: "
                             "both agree only for small displacements",
                             name);
    } else if (kind != BALL) {
        put_number(t, map, "stiffness", number(t, "stiffness"));
        put_number(t, map, "free_length", number(t, kind == DISTANCE ? "distance" : "free_length"));
        if (has(t, "damping"))
            put_number(t, map, "damping", number(t, "damping"));
    }
}

void kmp_drake_add(kmp_import *im, const kmp_element *model, const char *prefix, kmp_drake_point *point, void *reader)
{
    static const char *const offsets[2] = {"p_AP", "p_BQ"};
    for (int kind = 0; kind < TAGS; kind++) {
        int count = 0;
        for (const kmp_element *e = kmp_element_find(model, tags[kind].tag); e; e = kmp_element_again(e)) {
            const tag t = {.im = im, .e = e, .parts = tags[kind].parts};
            const char *name =
                           kmp_arena_printf(im->arena, "%s%s_%d", prefix, tags[kind].tag + strlen("drake:"), ++count),
                       *points[2] = {NULL, NULL};
            for (int end = 0; end < 2; end++) {
                const kmp_element *part = part_of(&t, tags[kind].frames[end]);
                const char *frame = part && part->text[0] ? part->text : kmp_element_text(part, "name");
                double at[3] = {0};
                if (!frame)
                    kmp_import_complain(im, e->place, "element", tags[kind].frames[end],
                                        "of this constraint is missing");
                if (kind != BUSHING)
                    read(&t, offsets[end], 3, at);
                points[end] = frame && name ? point(reader, part, frame, at, name) : NULL;
            }
            if (points[0] && points[1])
                add(&t, kind, name, points);
        }
    }
}
