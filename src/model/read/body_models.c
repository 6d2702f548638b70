/* SPDX-License-Identifier: BSD-3-Clause */
/* The document is changed before its bodies are read, so that each model is what its file would be, and what a body
 * cannot have is reported by the reader at its place. Rigid bodies are flexible ones without coordinates. */
#include "model/read/body_models.h"
#include "base/text.h"
#include "model/files/nodes.h"
#include <string.h>

static const char segments[] = "segments:";
enum { LENGTH = sizeof segments - 1 };

bool kmp_is_body_model(const char *word)
{
    static const char *const words[] = {"rigid", "none", "first", "full"};
    for (size_t k = 0; k < sizeof words / sizeof *words; k++)
        if (strcmp(word, words[k]) == 0)
            return true;
    return strncmp(word, segments, LENGTH) == 0 && word[LENGTH] &&
           strspn(word + LENGTH, "0123456789") == strlen(word + LENGTH);
}

static bool is_in(const char *word, const char *const *list)
{
    while (*list && strcmp(*list, word) != 0)
        list++;
    return *list;
}

/* Damping in proportion to the stiffness is the same in both: {time: T} of segments, {rayleigh: [0, T]} of shapes. */
static const kmp_yaml *damping_of(kmp_reader *r, const kmp_yaml *given, bool in_segments)
{
    const kmp_yaml *pair = kmp_yaml_get(given, "rayleigh"), *time = kmp_yaml_get(given, "time");
    kmp_yaml *made = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, given->place);
    double first = 1;
    if (in_segments && pair && pair->count == 2 && given->count == 1 && pair->items[0]->text &&
        kmp_text_to_number(pair->items[0]->text, &first) == strlen(pair->items[0]->text) && first == 0) {
        kmp_yaml_put(&r->scratch, made, given->place, "time", pair->items[1]);
        return made;
    }
    if (in_segments || !time)
        return given;
    kmp_yaml *both = kmp_yaml_new(&r->scratch, KMP_YAML_LIST, given->place);
    kmp_yaml_append(&r->scratch, both, NULL, kmp_yaml_word(&r->scratch, given->place, "0"));
    kmp_yaml_append(&r->scratch, both, NULL, time);
    kmp_yaml_put(&r->scratch, made, given->place, "rayleigh", both);
    return made;
}

static const kmp_yaml *flexible_as(kmp_reader *r, const kmp_yaml *given)
{
    static const char *const of_shapes[] = {"segments", "stiffening", "damping", NULL},
                             *const of_pieces[] = {"segments", "stiffening", "damping", "frame", "raw", NULL},
                             *const of_rigid[] = {"segments", "stiffening", "damping", "shapes", "modes", NULL};
    const bool divided = strncmp(r->bodies_as, segments, LENGTH) == 0, rigid = strcmp(r->bodies_as, "rigid") == 0;
    const kmp_yaml *damping = kmp_yaml_get(given, "damping");
    const char *const *left_out = divided ? of_pieces : rigid ? of_rigid : of_shapes;
    kmp_yaml *made = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, given->place);
    if (!made)
        return given;
    for (int k = 0; k < given->count; k++)
        if (!is_in(given->keys[k]->text, left_out))
            kmp_yaml_append(&r->scratch, made, given->keys[k], given->items[k]);
    if (rigid && kmp_yaml_get(given, "file"))
        kmp_yaml_put_word(&r->scratch, made, given->place, "modes", "0");
    else if (rigid)
        kmp_yaml_put(&r->scratch, made, given->place, "shapes", kmp_yaml_new(&r->scratch, KMP_YAML_MAP, given->place));
    else
        kmp_yaml_put_word(&r->scratch, made, given->place, divided ? "segments" : "stiffening",
                          divided ? r->bodies_as + LENGTH : r->bodies_as);
    if (damping && !rigid)
        kmp_yaml_put(&r->scratch, made, given->place, "damping", damping_of(r, damping, divided));
    return made;
}

static bool is_in_every_model(const kmp_yaml *output)
{
    static const char *const some[] = {"deflection(", "section(", "section_by_shapes(", "stress("};
    static const char *const counted[] = {"q", "qd", "qdd", NULL};
    const char *word = output->text ? output->text : "";
    bool every = !is_in(word, counted);
    for (size_t k = 0; k < sizeof some / sizeof *some; k++)
        every = every && strncmp(word, some[k], strlen(some[k])) != 0;
    return every;
}

static void choose_outputs(kmp_reader *r, kmp_yaml *root)
{
    const kmp_yaml *run = kmp_yaml_get(root, "run"), *outputs = kmp_yaml_get(run, "outputs");
    if (!outputs || outputs->kind != KMP_YAML_LIST)
        return;
    kmp_yaml *made = kmp_yaml_new(&r->scratch, KMP_YAML_LIST, outputs->place);
    for (int k = 0; k < outputs->count; k++)
        if (is_in_every_model(outputs->items[k]))
            kmp_yaml_append(&r->scratch, made, NULL, outputs->items[k]);
    kmp_yaml_set(&r->scratch, root, "run", kmp_yaml_with(&r->scratch, run, "outputs", made));
}

void kmp_read_body_models(kmp_reader *r)
{
    const kmp_yaml *map = kmp_yaml_get(r->root, "bodies");
    if (!r->bodies_as || !map || map->kind != KMP_YAML_MAP)
        return;
    kmp_yaml *root = kmp_yaml_copy(&r->scratch, r->root),
             *bodies = root ? kmp_yaml_open(&r->scratch, root, "bodies") : NULL;
    if (r->scratch.failed || !bodies)
        return;
    for (int k = 0; k < map->count; k++) {
        const kmp_yaml *flexible = kmp_yaml_get(map->items[k], "flexible");
        if (flexible && flexible->kind == KMP_YAML_MAP)
            bodies->items[k] = kmp_yaml_with(&r->scratch, map->items[k], "flexible", flexible_as(r, flexible));
    }
    choose_outputs(r, root);
    r->root = root;
}
