/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies from files: an archive of arrays where the input begins with `PK`, cards of bulk data where it begins
 * with `D`, `G` or `$`, and else standard input data. A body that is read has modes, mass and names, and its rigid
 * motions are counted; another one is refused with a reason. */
#include "base/arena.h"
#include "base/memory.h"
#include "fuzz.h"
#include "model/flexible/modal_file.h"
#include <math.h>

static const char *ending_of(const char *text)
{
    if (strncmp(text, "PK", 2) == 0)
        return "body.npz";
    return text[0] == 'D' || text[0] == 'G' || text[0] == '$' ? "body.pch" : "body.sid";
}

static void use(kmp_arena *arena, kmp_modal_file *file)
{
    kmp_modal_body *b = &file->body;
    kmp_text why = {0};
    fuzz_promise(b->count >= 1 && b->count <= KMP_MODAL_MODES_MOST && b->mass > 0, "modes and mass");
    for (int k = 0; k < b->place_count; k++)
        fuzz_promise(file->names[k] && isfinite(b->places[k].at[0]), "interfaces with names and places");
    double *elastic = KMP_ARENA_NEW(arena, double, b->count * b->count);
    const int rigid = elastic ? kmp_modal_rigid(b, elastic, &why) : 0;
    fuzz_promise(rigid >= 0 ? rigid <= b->count : why.length > 0 || arena->failed, "rigid motions, or a reason");
    kmp_modal_average(b);
    kmp_text_free(&why);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const double place[6] = {0, 0, 0, 1, 0, 0};
    static const int number[2] = {1, 2};
    const kmp_modal_units none = {0}, scale = {1, 1};
    kmp_arena arena = {0};
    kmp_modal_file file;
    kmp_text why = {0};
    char *text = kmp_calloc(size + 1, 1);
    if (!text)
        return 0;
    memcpy(text, data, size);
    const char *name = ending_of(text);
    const bool cards = strcmp(name, "body.pch") == 0, archive = strcmp(name, "body.npz") == 0;
    const kmp_modal_nodes nodes = {.count = cards ? 2 : 0, .number = number, .at = place};
    const kmp_modal_source source = {.arena = &arena,
                                     .bytes = text,
                                     .length = size,
                                     .units = archive ? &none : &scale,
                                     .nodes = &nodes,
                                     .to = &file,
                                     .why = &why};
    if (kmp_modal_file_read(name, &source))
        use(&arena, &file);
    else
        fuzz_promise(why.length > 0 || arena.failed, "a reason");
    kmp_text_free(&why);
    kmp_arena_free(&arena);
    kmp_free(text);
    return 0;
}
