/* SPDX-License-Identifier: BSD-3-Clause */
#include "command_place.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

char *cli_from_command(const char *relative)
{
    char command[PATH_MAX];
    ssize_t length = readlink("/proc/self/exe", command, sizeof command - 1);
    if (length <= 0)
        return NULL;
    command[length] = '\0';
    *strrchr(command, '/') = '\0';
    size_t size = strlen(command) + strlen(relative) + 2;
    char *path = malloc(size);
    if (path)
        (void)snprintf(path, size, "%s/%s", command, relative);
    return path;
}
