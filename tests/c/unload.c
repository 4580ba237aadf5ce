/* The library loaded from a new folder again and again, as importers do that unpack an archive for each run: nothing of it stays.
 * Arguments: the shared library, a folder to copy it into, how often. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int failures = 0;

#define CHECK(condition)                                                      \
    do {                                                                      \
        if (!(condition)) {                                                   \
            printf("unload.c:%d: %s\n", __LINE__, #condition);                \
            ++failures;                                                       \
        }                                                                     \
    } while (0)

static const char *SCENE =
    "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\nE = 15e3\nnu = 0.45\n"
    "[[bone]]\nname = \"fixed\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"moved\"\nnodes = \"x_max\"\n";

static char *bytes;
static size_t size;
static const char *folder;

static void copy(const char *path) {
    FILE *to = fopen(path, "wb");
    CHECK(to != NULL && fwrite(bytes, 1, size, to) == size);
    fclose(to);
}

/* Loads the copy, runs a little, unloads; the image must be gone. */
static void once(const char *path, const char *more) {
    typedef void *(*New)(const char *, const char *, char *, size_t);
    char why[300] = "", scene[2000];
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL), *symbol;
    if (library == NULL) {
        printf("%s\n", dlerror());
        ++failures;
        return;
    }
    New make;
    int (*initialise)(void *), (*step)(void *, double), (*set)(void *, size_t, const double *, size_t);
    size_t (*find)(void *, const char *);
    void (*release)(void *);
#define NAMED(function, name) symbol = dlsym(library, name), memcpy(&function, &symbol, sizeof symbol)
    NAMED(make, "cutis_sim_new_from_text"), NAMED(initialise, "cutis_sim_initialise"), NAMED(step, "cutis_sim_step");
    NAMED(set, "cutis_sim_set_f64"), NAMED(find, "cutis_port_find"), NAMED(release, "cutis_sim_free");
    snprintf(scene, sizeof scene, "%s%s", SCENE, more);
    void *sim = make(scene, NULL, why, sizeof why);
    if (sim == NULL) puts(why);
    double d[6] = {0.0, 0.0, 0.0, 0.004, 0.001, 0.0};
    CHECK(sim != NULL && initialise(sim) == 0);
    CHECK(set(sim, find(sim, "bone.translation"), d, 6) == 0 && step(sim, 0.1) == 0);
    release(sim);
    dlclose(library);
    CHECK(dlopen(path, RTLD_NOW | RTLD_NOLOAD) == NULL);
}

static long resident(void) {
    long pages = 0, all = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    CHECK(file != NULL && fscanf(file, "%ld %ld", &all, &pages) == 2);
    fclose(file);
    return pages * (sysconf(_SC_PAGESIZE) / 1024);
}

static void *on_a_thread(void *path) {
    once(path, "");
    return NULL;
}

/* The thread that used the library outlives it. */
static void *outlives(void *state) {
    void **words = state;
    once(words[0], "");
    pthread_barrier_wait(words[1]);
    pthread_barrier_wait(words[1]);
    return NULL;
}

int main(int argc, char **argv) {
    if (argc < 4) return 2;
    FILE *file = fopen(argv[1], "rb");
    struct stat status;
    if (file == NULL || fstat(fileno(file), &status) != 0) return 2;
    size = (size_t)status.st_size;
    bytes = malloc(size);
    CHECK(bytes != NULL && fread(bytes, 1, size, file) == size);
    fclose(file);
    folder = argv[2];
    const int loads = atoi(argv[3]);
    long settled = 0;
    char path[2000];
    for (int k = 0; k < loads && failures == 0; ++k) {
        snprintf(path, sizeof path, "%s/%d", folder, k);
        mkdir(path, 0777);
        snprintf(path, sizeof path, "%s/%d/libcutis.so", folder, k);
        copy(path);
        if (k % 10 == 3) {
            pthread_t thread;
            CHECK(pthread_create(&thread, NULL, on_a_thread, path) == 0 && pthread_join(thread, NULL) == 0);
        } else if (k % 10 == 5) {
            pthread_t thread;
            pthread_barrier_t barrier;
            pthread_barrier_init(&barrier, NULL, 2);
            void *words[2] = {path, &barrier};
            CHECK(pthread_create(&thread, NULL, outlives, words) == 0);
            pthread_barrier_wait(&barrier);
            pthread_barrier_wait(&barrier);
            CHECK(pthread_join(thread, NULL) == 0);
        } else if (k % 10 == 7) {
            once(path, "[solver]\nthreads = 2\n");
        } else if (k % 10 == 8) {
            once(path, "[solver]\nbackground = true\n");
        } else {
            once(path, "");
        }
        unlink(path);
        snprintf(path, sizeof path, "%s/%d", folder, k);
        rmdir(path);
        if (k == loads / 10) settled = resident();
    }
    const long grown = resident() - settled;
    printf("%d loads: resident memory grew by %ld KiB\n", loads, grown);
    CHECK(grown < 8 * 1024);
    char line[1000];
    file = fopen("/proc/self/maps", "r");
    while (fgets(line, sizeof line, file)) CHECK(strstr(line, "libcutis") == NULL);
    fclose(file);
    puts(failures == 0 ? "unload: all is well" : "unload: failed");
    return failures != 0;
}
