// LODE_SANITIZED: 1 where address, thread or memory sanitizers are built in. They bring operators new of their own, and
// map terabytes of addresses. GCC says so by __SANITIZE_*, clang by __has_feature.
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define LODE_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define LODE_SANITIZED 1
#endif
#endif
#ifndef LODE_SANITIZED
#define LODE_SANITIZED 0
#endif
