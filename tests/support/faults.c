/* Makes one call of a program fail: a library for LD_PRELOAD, which `faults.rs` compiles.

   Calls of the file system are caught at the kernel's door by a seccomp filter that raises SIGSYS, since libraries may
   call the kernel without libc. Only files below one folder are touched, so that drivers and libraries work as ever. The
   handler's own calls come from one instruction, which the filter lets through. Calls of Vulkan are caught where the
   program looks their addresses up; layers lie below that and see nothing of a call that fails.

   FAULT_BELOW=FOLDER   the files that may fail
   FAULT_LOG=FILE       gets a line for each call: its kind and its file; "!" before the one that failed
   FAULT="KIND N HOW"   call N of this kind, counted from 0, fails. KIND "any" counts all. HOW is a number of errno or a
                        VkResult, or a word: "short" (half of the bytes), "end" (no byte is left to read), "kill" (the
                        process dies before the call), "shrink" and "change" (somebody else cuts the file in half or
                        writes to it before the call). "N+" lets all later calls of the kind fail as well.
   FAULT_CLOCK=SECONDS  the clock of the day goes forward by so much whenever it is read */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <ucontext.h>
#include <unistd.h>

/* A call of the kernel that the filter lets through. */
long pass(long number, long a, long b, long c, long d, long e, long f);
extern const char passed[];
#if defined(__x86_64__)
#define ARCHITECTURE AUDIT_ARCH_X86_64
__asm__(".globl pass\npass:\n mov %rdi,%rax\n mov %rsi,%rdi\n mov %rdx,%rsi\n mov %rcx,%rdx\n mov %r8,%r10\n"
        " mov %r9,%r8\n mov 8(%rsp),%r9\n syscall\n.globl passed\npassed:\n ret\n");
#elif defined(__aarch64__)
#define ARCHITECTURE AUDIT_ARCH_AARCH64
__asm__(".globl pass\npass:\n mov x8,x0\n mov x0,x1\n mov x1,x2\n mov x2,x3\n mov x3,x4\n mov x4,x5\n mov x5,x6\n"
        " svc 0\n.globl passed\npassed:\n ret\n");
#endif

enum how { ERROR, SHORT, END, KILL, SHRINK, CHANGE };

static const char *const words[] = {"", "short", "end", "kill", "shrink", "change"};
static char below[4096], wanted[64];
static size_t below_length;
static int log_file = -1;
static long from, error;
static enum how how;
static int is_lasting;
static atomic_long count;

/* Whether this call is to fail. */
static int fails(const char *kind, const char *name)
{
    int is_wanted = strcmp(wanted, kind) == 0 || strcmp(wanted, "any") == 0;
    long number = is_wanted ? atomic_fetch_add(&count, 1) : -1;
    int is_it = is_wanted && (number == from || (is_lasting && number > from));
    char line[4400];
    int length = snprintf(line, sizeof line, "%s%s %s\n", is_it ? "!" : "", kind, name);
    pass(SYS_write, log_file, (long)line, length, 0, 0, 0);
    if (is_it && how == KILL)
        pass(SYS_kill, pass(SYS_getpid, 0, 0, 0, 0, 0, 0), SIGKILL, 0, 0, 0, 0);
    return is_it;
}

/* ---- Files ---- */

enum { OF_FILE, OF_NAME, OF_NAME_AT };

static const struct watched {
    long number;
    const char *kind;
    int of; /* The first argument is an open file or a name, or the first two are a folder and a name. */
} watched[] = {
    {SYS_openat, "open", OF_NAME_AT},
    {SYS_read, "read", OF_FILE},
    {SYS_readv, "read", OF_FILE},
    {SYS_pread64, "read", OF_FILE},
    {SYS_write, "write", OF_FILE},
    {SYS_writev, "write", OF_FILE},
    {SYS_pwrite64, "write", OF_FILE},
    {SYS_copy_file_range, "read", OF_FILE},
    {SYS_fsync, "fsync", OF_FILE},
    {SYS_fdatasync, "fsync", OF_FILE},
    {SYS_ftruncate, "truncate", OF_FILE},
    {SYS_flock, "lock", OF_FILE},
    {SYS_lseek, "seek", OF_FILE},
    {SYS_getdents64, "list", OF_FILE},
    {SYS_fstat, "stat", OF_FILE},
    {SYS_newfstatat, "stat", OF_NAME_AT},
    {SYS_statx, "stat", OF_NAME_AT},
    {SYS_mkdirat, "mkdir", OF_NAME_AT},
    {SYS_unlinkat, "remove", OF_NAME_AT},
    {SYS_renameat, "rename", OF_NAME_AT},
    {SYS_renameat2, "rename", OF_NAME_AT},
#ifdef SYS_open
    {SYS_open, "open", OF_NAME},
    {SYS_stat, "stat", OF_NAME},
    {SYS_lstat, "stat", OF_NAME},
    {SYS_mkdir, "mkdir", OF_NAME},
    {SYS_unlink, "remove", OF_NAME},
    {SYS_rename, "rename", OF_NAME},
#endif
};
enum { WATCHED = sizeof watched / sizeof *watched };

/* The absolute name of what a call is about. Returns whether it has one. */
static int name_of(const struct watched *call, const long arguments[6], char *name, size_t size)
{
    const char *given = call->of == OF_NAME_AT ? (const char *)arguments[1]
                        : call->of == OF_NAME  ? (const char *)arguments[0]
                                               : "";
    long folder = call->of == OF_NAME ? AT_FDCWD : (int)arguments[0];
    if (!given)
        given = "";
    if (given[0] == '/')
        return snprintf(name, size, "%s", given) < (int)size;
    char link[64];
    if (folder == AT_FDCWD)
        snprintf(link, sizeof link, "/proc/self/cwd");
    else
        snprintf(link, sizeof link, "/proc/self/fd/%ld", folder);
    long length = pass(SYS_readlinkat, AT_FDCWD, (long)link, (long)name, size - 1, 0, 0);
    if (length < 0)
        return 0;
    snprintf(name + length, size - length, "%s%s", given[0] ? "/" : "", given);
    return 1;
}

/* What somebody else does to a file that is open here. */
static void meddle(long file)
{
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%ld", file);
    struct stat about;
    if (pass(SYS_fstat, file, (long)&about, 0, 0, 0, 0) < 0)
        return;
    long other = pass(SYS_openat, AT_FDCWD, (long)link, O_WRONLY, 0, 0, 0);
    if (how == SHRINK)
        pass(SYS_ftruncate, other, about.st_size / 2, 0, 0, 0, 0);
    else
        pass(SYS_pwrite64, other, (long)"\xa5", 1, about.st_size / 2, 0, 0);
    pass(SYS_close, other, 0, 0, 0, 0, 0);
}

static long call_kernel(long number, const long a[6])
{
    const struct watched *call = watched;
    while (call < watched + WATCHED && call->number != number)
        call++;
    char name[4300];
    int is_below = call < watched + WATCHED && name_of(call, a, name, sizeof name) &&
                   strncmp(name, below, below_length) == 0 &&
                   (name[below_length] == '/' || name[below_length] == 0);
    if (is_below) {
        int flags = call->of == OF_NAME ? a[1] : a[2];
        int makes = strcmp(call->kind, "open") == 0 && (flags & (O_CREAT | O_TMPFILE) & ~O_DIRECTORY);
        const char *within = name[below_length] ? name + below_length + 1 : ".";
        if (fails(makes ? "create" : call->kind, within)) {
            if (how == ERROR)
                return -error;
            if (how == END)
                return 0;
            if (how == SHORT && (number == SYS_read || number == SYS_write || number == SYS_pread64 ||
                                 number == SYS_pwrite64))
                return pass(number, a[0], a[1], a[2] > 1 ? a[2] / 2 : a[2], a[3], a[4], a[5]);
            if (how == SHRINK || how == CHANGE)
                meddle(a[0]);
        }
    }
    return pass(number, a[0], a[1], a[2], a[3], a[4], a[5]);
}

static void on_call(int signal, siginfo_t *info, void *context)
{
    (void)signal;
    int before = errno;
    mcontext_t *machine = &((ucontext_t *)context)->uc_mcontext;
#if defined(__x86_64__)
    greg_t *r = machine->gregs;
    long arguments[6] = {r[REG_RDI], r[REG_RSI], r[REG_RDX], r[REG_R10], r[REG_R8], r[REG_R9]};
    r[REG_RAX] = call_kernel(info->si_syscall, arguments);
#elif defined(__aarch64__)
    long arguments[6];
    for (int i = 0; i < 6; i++)
        arguments[i] = machine->regs[i];
    machine->regs[0] = call_kernel(info->si_syscall, arguments);
#endif
    errno = before;
}

static int watch_kernel(void)
{
    enum { AT_ARCHITECTURE = offsetof(struct seccomp_data, arch), AT_NUMBER = offsetof(struct seccomp_data, nr) };
    enum { AT_PLACE = offsetof(struct seccomp_data, instruction_pointer) };
    uintptr_t place = (uintptr_t)passed;
    struct sock_filter filter[WATCHED + 16];
    unsigned short n = 0;
#define LOAD(offset) filter[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offset)
#define SKIP_UNLESS(value, steps) filter[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, steps)
#define END_WITH(verdict) filter[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, verdict)
    LOAD(AT_ARCHITECTURE);
    filter[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ARCHITECTURE, 1, 0);
    END_WITH(SECCOMP_RET_ALLOW);
    LOAD(AT_PLACE);
    SKIP_UNLESS((uint32_t)place, 3);
    LOAD(AT_PLACE + 4);
    SKIP_UNLESS((uint32_t)((uint64_t)place >> 32), 1);
    END_WITH(SECCOMP_RET_ALLOW);
    LOAD(AT_NUMBER);
    for (int i = 0; i < WATCHED; i++)
        filter[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, watched[i].number, WATCHED - i, 0);
    END_WITH(SECCOMP_RET_ALLOW);
    END_WITH(SECCOMP_RET_TRAP);
    struct sock_fprog program = {n, filter};
    struct sigaction action = {.sa_sigaction = on_call, .sa_flags = SA_SIGINFO | SA_NODEFER | SA_RESTART};
    return sigaction(SIGSYS, &action, NULL) || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) ||
           prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program);
}

/* ---- The clock ---- */

int clock_gettime(clockid_t clock, struct timespec *time)
{
    static atomic_long readings;
    const char *step = getenv("FAULT_CLOCK");
    long result = pass(SYS_clock_gettime, clock, (long)time, 0, 0, 0, 0);
    if (step && clock == CLOCK_REALTIME)
        time->tv_sec += atol(step) * atomic_fetch_add(&readings, 1);
    return result < 0 ? (errno = -result, -1) : 0;
}

/* ---- Vulkan ---- */

enum { DEVICE_LOST = -4 };

/* A device that was lost stays so: those calls say it from then on that may. */
static atomic_int is_lost;

/* Any function that returns a VkResult: none has more arguments, and none takes floating-point numbers. */
typedef int (*function)(long, long, long, long, long, long, long, long);
typedef function (*look_up)(void *, const char *);

/* MAKES returns at once when it fails. WAITS does its work in either case: a device that is lost has stopped working by the
   time that the program is told. */
#define FUNCTIONS(MAKES, WAITS)                                                                                        \
    MAKES(vkCreateInstance) MAKES(vkEnumeratePhysicalDevices) MAKES(vkEnumerateDeviceExtensionProperties)              \
    MAKES(vkCreateDebugUtilsMessengerEXT) MAKES(vkCreateDevice) MAKES(vkAllocateMemory) MAKES(vkMapMemory)             \
    MAKES(vkBindBufferMemory) MAKES(vkBindImageMemory) MAKES(vkCreateBuffer) MAKES(vkCreateImage)                      \
    MAKES(vkCreateImageView) MAKES(vkCreateSampler) MAKES(vkCreateShaderModule) MAKES(vkCreatePipelineCache)           \
    MAKES(vkGetPipelineCacheData) MAKES(vkCreateComputePipelines) MAKES(vkCreateGraphicsPipelines)                     \
    MAKES(vkCreatePipelineLayout) MAKES(vkCreateDescriptorSetLayout) MAKES(vkCreateDescriptorPool)                     \
    MAKES(vkResetDescriptorPool) MAKES(vkAllocateDescriptorSets) MAKES(vkCreateFence) MAKES(vkResetFences)             \
    MAKES(vkCreateSemaphore) MAKES(vkCreateCommandPool) MAKES(vkAllocateCommandBuffers)                                \
    MAKES(vkResetCommandBuffer) MAKES(vkBeginCommandBuffer) MAKES(vkEndCommandBuffer) MAKES(vkCreateQueryPool)         \
    MAKES(vkQueueSubmit) MAKES(vkQueueSubmit2) MAKES(vkCreateSwapchainKHR) MAKES(vkGetSwapchainImagesKHR)              \
    MAKES(vkGetPhysicalDeviceSurfaceSupportKHR) MAKES(vkGetPhysicalDeviceSurfaceCapabilitiesKHR)                       \
    MAKES(vkGetPhysicalDeviceSurfaceFormatsKHR) MAKES(vkAcquireNextImageKHR) MAKES(vkCreateXcbSurfaceKHR)              \
    MAKES(vkCreateXlibSurfaceKHR) WAITS(vkQueuePresentKHR) WAITS(vkGetQueryPoolResults) WAITS(vkWaitForFences)         \
    WAITS(vkQueueWaitIdle) WAITS(vkDeviceWaitIdle)

static int says_lost(const char *kind)
{
    static const char *const may[] = {"vkQueueSubmit",   "vkQueueSubmit2",        "vkAcquireNextImageKHR",
                                      "vkQueuePresentKHR", "vkGetQueryPoolResults", "vkWaitForFences",
                                      "vkQueueWaitIdle", "vkDeviceWaitIdle",      "vkCreateSwapchainKHR"};
    for (size_t i = 0; atomic_load(&is_lost) && i < sizeof may / sizeof *may; i++)
        if (strcmp(kind, may[i]) == 0)
            return 1;
    return 0;
}

static int call_vulkan(const char *kind, int waits, function call, const long a[8])
{
    int verdict = says_lost(kind) ? DEVICE_LOST : fails(kind, "") ? (int)error : 0;
    if (verdict == DEVICE_LOST)
        atomic_store(&is_lost, 1);
    int result = 0;
    if (verdict == 0 || waits)
        result = call(a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]);
    return verdict ? verdict : result;
}

#define DEFINE(name, waits)                                                                                            \
    static function real_##name;                                                                                       \
    static int my_##name(long a, long b, long c, long d, long e, long f, long g, long h)                               \
    {                                                                                                                  \
        long arguments[8] = {a, b, c, d, e, f, g, h};                                                                  \
        return call_vulkan(#name, waits, real_##name, arguments);                                                      \
    }
#define DEFINE_MAKES(name) DEFINE(name, 0)
#define DEFINE_WAITS(name) DEFINE(name, 1)
FUNCTIONS(DEFINE_MAKES, DEFINE_WAITS)

static function mine(const char *name, function real)
{
#define IS_IT(it)                                                                                                      \
    if (real && strcmp(name, #it) == 0) {                                                                              \
        real_##it = real;                                                                                              \
        return my_##it;                                                                                                \
    }
    FUNCTIONS(IS_IT, IS_IT)
    return real;
}

static look_up real_of_instance, real_of_device;

static function of_device(void *device, const char *name)
{
    return mine(name, real_of_device(device, name));
}

static function of_instance(void *instance, const char *name)
{
    function real = real_of_instance(instance, name);
    if (real && strcmp(name, "vkGetInstanceProcAddr") == 0)
        return (function)(void *)of_instance;
    if (real && strcmp(name, "vkGetDeviceProcAddr") == 0) {
        real_of_device = (look_up)(void *)real;
        return (function)(void *)of_device;
    }
    return mine(name, real);
}

static void *real_dlsym(void *library, const char *name)
{
    static void *(*real)(void *, const char *);
    static const char *const versions[] = {"GLIBC_2.34", "GLIBC_2.17", "GLIBC_2.2.5"};
    for (size_t i = 0; !real && i < sizeof versions / sizeof *versions; i++)
        real = (void *(*)(void *, const char *))dlvsym(RTLD_NEXT, "dlsym", versions[i]);
    return real(library, name);
}

/* The program loads the loader of Vulkan by itself, and asks it for this one function; so does that for its drivers'. */
void *dlsym(void *library, const char *name)
{
    void *found = real_dlsym(library, name);
    if (!found || real_of_instance || strcmp(name, "vkGetInstanceProcAddr") != 0)
        return found;
    real_of_instance = (look_up)found;
    return (void *)of_instance;
}

/* ---- The begin ---- */

__attribute__((constructor)) static void begin(void)
{
    const char *folder = getenv("FAULT_BELOW"), *log = getenv("FAULT_LOG"), *fault = getenv("FAULT");
    if (!folder || !log)
        return;
    log_file = open(log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    below_length = snprintf(below, sizeof below, "%s", folder);
    char at[32], as[32];
    if (fault && sscanf(fault, "%63s %31s %31s", wanted, at, as) == 3) {
        char *rest;
        from = strtol(at, &rest, 10);
        is_lasting = *rest == '+';
        error = strtol(as, NULL, 10);
        for (int i = 1; i < (int)(sizeof words / sizeof *words); i++)
            if (strcmp(as, words[i]) == 0)
                how = (enum how)i;
    }
    if (log_file < 0 || watch_kernel()) {
        static const char why[] = "faults.c: the calls of this process cannot be watched\n";
        pass(SYS_write, 2, (long)why, sizeof why - 1, 0, 0, 0);
        _exit(99);
    }
}
