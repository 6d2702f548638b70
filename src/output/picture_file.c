/* SPDX-License-Identifier: BSD-3-Clause */
/* librsvg draws the same SVG as a bitmap. It is loaded when a first .png is asked for: linked with it every command
 * would take 8 ms longer to start, and a machine without it could not run Kempe. */
#include "output/picture_file.h"
#include "base/file.h"
#include <dlfcn.h>
#include <string.h>

/* Pixels of the bitmap for one of the picture. */
#define SCALE 2.0

/* Functions of librsvg 2.52, glib and cairo 1.16 by their own names; their types are opaque here. */
typedef struct rectangle {
    double x, y, width, height;
} rectangle;

typedef int put_fn(void *user, const unsigned char *bytes, unsigned int length);

typedef struct library {
    void *(*new_from_data)(const unsigned char *data, size_t length, void **error);
    int (*get_size)(void *handle, double *width, double *height);
    int (*render)(void *handle, void *cairo, const rectangle *viewport, void **error);
    void (*unref)(void *object);
    void *(*surface)(int format, int width, int height);
    void *(*create)(void *surface);
    int (*write)(void *surface, put_fn *put, void *user);
    void (*destroy)(void *cairo);
    void (*surface_destroy)(void *surface);
} library;

/* Dependencies of librsvg are found through it. */
static bool load(library *l)
{
    static const char *const names[] = {"rsvg_handle_new_from_data",
                                        "rsvg_handle_get_intrinsic_size_in_pixels",
                                        "rsvg_handle_render_document",
                                        "g_object_unref",
                                        "cairo_image_surface_create",
                                        "cairo_create",
                                        "cairo_surface_write_to_png_stream",
                                        "cairo_destroy",
                                        "cairo_surface_destroy"};
    void *at[sizeof names / sizeof *names], *opened = dlopen("librsvg-2.so.2", RTLD_NOW | RTLD_LOCAL);
    bool all = opened;
    for (size_t k = 0; all && k < sizeof names / sizeof *names; k++)
        all = (at[k] = dlsym(opened, names[k]));
    _Static_assert(sizeof at == sizeof *l, "a name for each function");
    if (all)
        memcpy(l, at, sizeof at);
    return all;
}

static int put(void *user, const unsigned char *bytes, unsigned int length)
{
    kmp_text *png = user;
    kmp_text_append(png, (const char *)bytes, length);
    return png->failed; /* CAIRO_STATUS_SUCCESS is 0, CAIRO_STATUS_NO_MEMORY 1 */
}

/* The bitmap of a picture; false: librsvg refused. */
static bool draw(const library *l, const kmp_text *svg, kmp_text *png)
{
    double width = 0, height = 0;
    void *handle = l->new_from_data((const unsigned char *)svg->s, svg->length, NULL);
    if (!handle)
        return false;
    bool ok = l->get_size(handle, &width, &height);
    const rectangle all = {0, 0, SCALE * width, SCALE * height};
    void *surface = l->surface(0, (int)all.width, (int)all.height), *cairo = l->create(surface);
    ok = ok && l->render(handle, cairo, &all, NULL) && l->write(surface, put, png) == 0;
    l->destroy(cairo);
    l->surface_destroy(surface);
    l->unref(handle);
    return ok;
}

static kempe_status write_png(kempe_context *context, const char *path, const kmp_text *svg)
{
    library l;
    kmp_text png = {0};
    KMP_TRY(kmp_made(context, !svg->failed));
    if (!load(&l))
        return kmp_fail(context, KEMPE_E_FAILED,
                        "%s: a .png needs librsvg, which is not here (Debian package librsvg2-2); a .svg needs nothing",
                        path);
    if (draw(&l, svg, &png))
        return kmp_file_write(context, path, &png);
    kmp_text_free(&png);
    return kmp_fail(context, KEMPE_E_FAILED, "%s: librsvg could not draw the picture; write it as .svg", path);
}

bool kmp_picture_png(const kmp_text *svg, kmp_text *png)
{
    library l;
    kmp_text drawn = {0};
    bool ok = !svg->failed && load(&l) && draw(&l, svg, &drawn) && !drawn.failed;
    if (ok)
        kmp_text_append(png, drawn.s, drawn.length);
    kmp_text_free(&drawn);
    return ok && !png->failed;
}

kempe_status kmp_picture_write(kempe_context *context, const char *path, kmp_text *svg)
{
    if (strcmp(kmp_file_ending(path), ".png") != 0)
        return kmp_file_write(context, path, svg);
    kempe_status status = write_png(context, path, svg);
    kmp_text_free(svg);
    return status;
}
