/* SPDX-License-Identifier: BSD-3-Clause */
/* Loops of a robot in a separate file, as LAAS-CNRS publishes robots with closed chains: `closed_loop` lists pairs
 * of frames of the URDF file in its folder, which coincide (docs/urdf.md). The document includes that file. */
#include "base/file.h"
#include "base/memory.h"
#include "exchange/formats/importing.h"
#include "model/language/nearest.h"
#include "platform/platform.h"
#include <ctype.h>
#include <string.h>

typedef struct pairs {
    kmp_import *im;
    const kmp_element *robot; /* of the URDF file */
    const char *file, *path;  /* its name, and with the folder */
} pairs;

static const char *const known[] = {"closed_loop", "type", "joint_name", "joint_type", "name_mot"};

/* -- the robot ----------------------------------------------------------------------------------------- */

/* The file of a folder with this ending, ".urdf", the first one by name; NULL: none, or no memory. `*count`: how many
 * files have it. */
static char *find_file(const char *folder, const char *ending, int *count)
{
    kmp_folder_names *names = kmp_folder_names_begin(folder);
    char *first = NULL;
    *count = 0;
    for (const char *name = names ? kmp_folder_names_next(names) : NULL; name; name = kmp_folder_names_next(names)) {
        if (name[0] == '.' || strcmp(kmp_file_ending(name), ending) != 0)
            continue;
        *count += 1;
        if (first && strcmp(name, first) > 0)
            continue;
        kmp_free(first);
        first = kmp_strdup(name);
    }
    kmp_folder_names_end(names);
    return first;
}

static const char *beside(kmp_import *im, const char *name)
{
    return kmp_arena_printf(im->arena, "%.*s%s", (int)kmp_path_folder(im->file), im->file, name);
}

/* A robot of another name is taken if it is the only one in the folder. */
static bool other_robot(pairs *p)
{
    const char *folder = beside(p->im, "");
    int count = 0;
    char *found = find_file(folder && folder[0] ? folder : ".", ".urdf", &count);
    if (count == 1 && found) {
        p->file = kmp_arena_strdup(p->im->arena, found);
        p->path = p->file ? beside(p->im, p->file) : NULL;
    } else
        kmp_import_complain(
            p->im, p->im->root->place, "the robot", p->path,
            count > 1 ? "of these loops cannot be read, and the folder has several other files with the ending .urdf"
                      : "of these loops cannot be read, and the folder has no other file with the ending .urdf");
    kmp_free(found);
    return count == 1 && p->path;
}

/* Reads the robot, the file with the ending .urdf in the folder of the loops, only for the names of its frames: the
 * reader that includes it reports its errors. */
static bool read_robot(pairs *p)
{
    kempe_context *aside = kempe_context_new();
    char *text = NULL;
    size_t length;
    const char *from = kmp_path_name(p->im->file);
    p->file = kmp_arena_printf(p->im->arena, "%.*s.urdf", (int)(strlen(from) - strlen(kmp_file_ending(from))), from);
    p->path = p->file ? beside(p->im, p->file) : NULL;
    bool read = aside && p->path && kmp_file_read(aside, KMP_FILE_INCLUDED, p->path, &text, &length) == KEMPE_OK;
    if (!read && aside && p->path && other_robot(p)) {
        read = kmp_file_read(aside, KMP_FILE_INCLUDED, p->path, &text, &length) == KEMPE_OK;
        if (!read)
            kmp_import_complain(p->im, p->im->root->place, "the robot", p->path, "of these loops cannot be read");
    }
    if (read &&
        kmp_xml_load(aside, p->im->arena, p->path, 0, text, length, (const char *const[]){NULL}, &p->robot) != KEMPE_OK)
        p->im->status = kmp_fail(p->im->context, KEMPE_E_INPUT, "%s", kempe_context_message(aside));
    kmp_free(text);
    kempe_context_free(aside);
    return p->robot;
}

/* -- loops --------------------------------------------------------------------------------------------- */

/* Lists of one length: entries of `first` and of the list under `key`, which may be absent. */
static bool fits(kmp_import *im, const kmp_yaml *first, const kmp_yaml *second, const char *key)
{
    if (second && (second->kind != KMP_YAML_LIST || second->count != first->count))
        kmp_import_complain(im, second->place, "the list", key, "must have one entry for each of the other list");
    return im->status == KEMPE_OK;
}

/* The common beginning of both names, as closedloop1 of closedloop1_A and closedloop1_B; otherwise both names. */
static const char *loop_name(kmp_import *im, const kmp_yaml *pair, const kmp_yaml *loops)
{
    const char *first = kmp_import_clean(im, pair->items[0]->text),
               *second = kmp_import_clean(im, pair->items[1]->text);
    int same = 0;
    while (first && second && first[same] && first[same] == second[same])
        same++;
    while (same > 0 && first[same - 1] == '_')
        same--;
    const char *name = first && second ? kmp_arena_printf(im->arena, "%.*s", same, first) : NULL;
    return name && name[0] && !kmp_yaml_get(loops, name)
               ? name
               : kmp_arena_printf(im->arena, "%s_%s", first ? first : "", second ? second : "");
}

/* LINK.origin of a frame, which is a link, or a joint: then the frame of the link behind it. */
static const char *frame_of(const pairs *p, const kmp_yaml *node)
{
    const kmp_element *joint = kmp_element_named(p->robot, "link", "name", node->text)
                                   ? NULL
                                   : kmp_element_named(p->robot, "joint", "name", node->text);
    const char *link = joint ? kmp_element_text(kmp_element_find(joint, "child"), "link") : node->text;
    if (!joint && !kmp_element_named(p->robot, "link", "name", node->text))
        kmp_import_complain(p->im, node->place, "the frame", node->text, "is neither a link nor a joint of the robot");
    const char *clean = link ? kmp_import_clean(p->im, link) : NULL;
    return clean ? kmp_arena_printf(p->im->arena, "%s.origin", clean) : NULL;
}

static void add_pair(pairs *p, const kmp_yaml *pair, const kmp_yaml *type)
{
    kmp_import *im = p->im;
    bool ball = type && (strcmp(type->text, "3d") == 0 || strcmp(type->text, "3D") == 0);
    if (type && !ball && strcmp(type->text, "6d") != 0 && strcmp(type->text, "6D") != 0) {
        kmp_import_complain(im, type->place, "type", type->text, "is unknown; available: 3d, 6d");
        return;
    }
    if (pair->kind != KMP_YAML_LIST || pair->count != 2) {
        kmp_import_complain(im, pair->place, "an entry of", "closed_loop", "is a pair of frames, [A, B]");
        return;
    }
    kmp_yaml *loops = kmp_import_part(im, im->root, "loops", KMP_YAML_MAP);
    kmp_yaml *map = kmp_import_map(im, pair->place), *points = kmp_yaml_new(im->arena, KMP_YAML_LIST, pair->place);
    for (int k = 0; k < 2; k++) {
        const char *point = frame_of(p, pair->items[k]);
        kmp_yaml_append(im->arena, points, NULL, kmp_yaml_word(im->arena, pair->items[k]->place, point ? point : ""));
    }
    kmp_import_put(im, map, pair->place, ball ? "ball" : "weld", points);
    const char *name = loop_name(im, pair, loops);
    if (name && kmp_yaml_get(loops, name))
        kmp_import_complain(im, pair->place, "the pair", name, "is given twice");
    else if (name)
        kmp_import_put(im, loops, pair->place, name, map);
}

/* -- other joints -------------------------------------------------------------------------------------- */

/* UJOINT_XY: a turn about x, then one about y. */
static bool is_universal(const char *type)
{
    return strlen(type) == 9 && strncmp(type, "UJOINT_", 7) == 0 && strchr("XYZ", type[7]) && strchr("XYZ", type[8]) &&
           type[7] != type[8];
}

static kmp_yaml *other_joints(const pairs *p, const kmp_yaml *source)
{
    kmp_import *im = p->im;
    const kmp_yaml *names = kmp_yaml_get(source, "joint_name"), *types = kmp_yaml_get(source, "joint_type");
    kmp_yaml *joints = kmp_import_map(im, source->place);
    if (!names || names->kind != KMP_YAML_LIST || !types) {
        if (names || types)
            kmp_import_complain(im, (names ? names : types)->place, "the list", names ? "joint_type" : "joint_name",
                                "is missing");
        return joints;
    }
    for (int k = 0; fits(im, names, types, "joint_type") && k < names->count; k++) {
        const kmp_yaml *name = names->items[k];
        const char *clean = kmp_import_clean(im, name->text);
        const kmp_yaml *type = types->items[k];
        kmp_yaml *other = kmp_import_map(im, type->place), *axes = kmp_yaml_new(im->arena, KMP_YAML_LIST, type->place);
        if (strcmp(type->text, "FIXED") == 0)
            kmp_import_word(im, other, type->place, "weld", "yes");
        else if (strcmp(type->text, "SPHERICAL") == 0)
            kmp_import_word(im, other, type->place, "spherical", "x");
        else if (is_universal(type->text)) {
            for (int i = 7; i < 9; i++) {
                const char axis[2] = {(char)tolower((unsigned char)type->text[i]), 0};
                kmp_yaml_append(im->arena, axes, NULL, kmp_yaml_word(im->arena, type->place, axis));
            }
            kmp_import_put(im, other, type->place, "universal", axes);
        } else
            kmp_import_complain(im, type->place, "joint_type", type->text,
                                "is unknown; available: FIXED, SPHERICAL, UJOINT_XY with two different axes");
        if (!kmp_element_named(p->robot, "joint", "name", name->text))
            kmp_import_leave_out(im, name->place, KMP_PART_AT_TIMES, name->text,
                                 "the joint '%s' of joint_name is not used: the robot does not have it", name->text);
        else if (clean && kmp_yaml_get(joints, clean))
            kmp_import_complain(im, name->place, "the joint", name->text, "is given twice");
        else if (clean)
            kmp_import_put(im, joints, name->place, clean, other);
    }
    return joints;
}

/* -- documents ----------------------------------------------------------------------------------------- */

/* A run takes independent coordinates by name only if they are as many as the degrees of freedom. */
static void note_motors(kmp_import *im, const kmp_yaml *source)
{
    kmp_text names = {0};
    const kmp_yaml *motors = kmp_yaml_get(source, "name_mot");
    for (int i = 0; motors && i < motors->count; i++)
        kmp_text_printf(&names, "%s%s", i > 0 ? ", " : "", motors->items[i]->text);
    if (names.length > 0)
        kmp_import_leave_out(im, motors->place, KMP_PART_REMARK, "name_mot",
                             "the motors of 'name_mot' are not used; name them in 'hold' of the start, or as many as "
                             "degrees of freedom in 'independent' of the run: %s",
                             names.s);
    kmp_text_free(&names);
}

void kmp_laas_convert(kmp_import *im)
{
    pairs p = {.im = im};
    const kmp_yaml *source = im->source, *loops = kmp_yaml_get(source, "closed_loop"),
                   *types = kmp_yaml_get(source, "type");
    if (loops->kind != KMP_YAML_LIST) {
        kmp_import_complain(im, loops->place, "the value of", "closed_loop", "is a list of pairs of frames");
        return;
    }
    if (!fits(im, loops, types, "type") || !read_robot(&p))
        return;
    kmp_yaml *list = kmp_import_part(im, im->root, "include", KMP_YAML_LIST),
             *entry = kmp_import_map(im, source->place);
    const char *name = kmp_element_text(p.robot, "name");
    if (name)
        kmp_import_word(im, im->root, source->place, "name", name);
    kmp_import_word(im, entry, source->place, "file", p.file);
    if (im->base != KMP_BASE_OF_FORMAT)
        kmp_import_word(im, entry, source->place, "base", im->base == KMP_BASE_FREE ? "free" : "fixed");
    kmp_yaml *joints = other_joints(&p, source);
    if (joints && joints->count > 0)
        kmp_import_put(im, entry, joints->place, "joints", joints);
    kmp_yaml_append(im->arena, list, NULL, entry);
    for (int k = 0; k < loops->count && im->status == KEMPE_OK; k++)
        add_pair(&p, loops->items[k], types ? types->items[k] : NULL);
    note_motors(im, source);
    for (int i = 0; i < source->count; i++)
        if (kmp_name_find(KMP_NAMES_OF(known), source->keys[i]->text) < 0)
            kmp_import_leave_out(im, source->keys[i]->place, KMP_PART_MECHANICS, source->keys[i]->text,
                                 "'%s' is not used", source->keys[i]->text);
}
