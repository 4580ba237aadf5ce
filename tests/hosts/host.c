/* The smallest FMI 3.0 importer: an unpacked archive, a few steps, numbers on the screen. No header of the standard, no
 * header of cutis: what is declared here is what an importer finds by name.
 *
 *   host LIBRARY RESOURCES TOKEN
 *
 * fmu/release builds it for every platform and runs it there, under Wine and qemu: all must print the same. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef _WIN32
#include <windows.h>
static void *open_library(const char *path) { return (void *)LoadLibraryA(path); }
static void *find(void *library, const char *name) { return (void *)(uintptr_t)GetProcAddress((HMODULE)library, name); }
static unsigned long why(void) { return GetLastError(); }
#else
#include <dlfcn.h>
static void *open_library(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void *find(void *library, const char *name) { return dlsym(library, name); }
static unsigned long why(void) {
    fprintf(stderr, "%s\n", dlerror());
    return 0;
}
#endif

typedef void (*Log)(void *, int, const char *, const char *);
typedef void *(*Instantiate)(const char *, const char *, const char *, uint8_t, uint8_t, uint8_t, uint8_t,
                             const uint32_t *, size_t, void *, Log, void *);
typedef int (*Plain)(void *);
typedef int (*Enter)(void *, uint8_t, double, double, uint8_t, double);
typedef int (*Set)(void *, const uint32_t *, size_t, const double *, size_t);
typedef int (*Get)(void *, const uint32_t *, size_t, double *, size_t);
typedef int (*Step)(void *, double, double, uint8_t, uint8_t *, uint8_t *, uint8_t *, double *);
typedef void (*Free)(void *);

static int messages = 0;

static void tell(void *environment, int status, const char *category, const char *message) {
    (void)environment;
    ++messages;
    fprintf(stderr, "status %d, %s: %s\n", status, category, message);
}

#define CHECK(call)                                          \
    do {                                                     \
        int status = (call);                                 \
        if (status > 1) {                                    \
            fprintf(stderr, "%s: status %d\n", #call, status); \
            return 1;                                        \
        }                                                    \
    } while (0)

/* Value references of bone.translation and bone.reactionForce, which are never renumbered. */
enum { TRANSLATION = 10, REACTION = 120, STEPS = 4 };

int main(int argc, char **argv) {
    if (argc != 4) {
        fprintf(stderr, "host LIBRARY RESOURCES TOKEN\n");
        return 2;
    }
    void *library = open_library(argv[1]);
    if (!library) {
        fprintf(stderr, "%s does not load: %lu\n", argv[1], why());
        return 1;
    }
    Instantiate instantiate = (Instantiate)(uintptr_t)find(library, "fmi3InstantiateCoSimulation");
    Enter enter = (Enter)(uintptr_t)find(library, "fmi3EnterInitializationMode");
    Plain leave = (Plain)(uintptr_t)find(library, "fmi3ExitInitializationMode");
    Plain terminate = (Plain)(uintptr_t)find(library, "fmi3Terminate");
    Set set = (Set)(uintptr_t)find(library, "fmi3SetFloat64");
    Get get = (Get)(uintptr_t)find(library, "fmi3GetFloat64");
    Step step = (Step)(uintptr_t)find(library, "fmi3DoStep");
    Free release = (Free)(uintptr_t)find(library, "fmi3FreeInstance");
    if (!instantiate || !enter || !leave || !terminate || !set || !get || !step || !release) {
        fprintf(stderr, "%s lacks a function\n", argv[1]);
        return 1;
    }

    /* A wrong token must be refused and told of, on every platform. */
    if (instantiate("wrong", "no token", argv[2], 0, 1, 0, 0, NULL, 0, NULL, tell, NULL) || messages == 0) {
        fprintf(stderr, "a wrong token passes\n");
        return 1;
    }
    void *instance = instantiate("host", argv[3], argv[2], 0, 1, 0, 0, NULL, 0, NULL, tell, NULL);
    if (!instance) return 1;
    CHECK(enter(instance, 0, 0.0, 0.0, 0, 0.0));
    CHECK(leave(instance));
    for (int k = 0; k < STEPS; ++k) {
        const uint32_t translation = TRANSLATION, reaction = REACTION;
        double d[6] = {0, 0, 0, 0, 0, -1e-3 * (k + 1)}, f[6] = {0}, t = 0;
        uint8_t event, end, early;
        CHECK(set(instance, &translation, 1, d, 6));
        CHECK(step(instance, 0.01 * k, 0.01, 1, &event, &end, &early, &t));
        CHECK(get(instance, &reaction, 1, f, 6));
        printf("t = %.2f s  reaction of the jaw %.9e %.9e %.9e N\n", t, f[3], f[4], f[5]);
    }
    CHECK(terminate(instance));
    release(instance);
    return 0;
}
