#include "render/vulkan/device.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <memory>
#include <type_traits>

#include "render/vulkan/loaded_libraries.h"
#include "render/window/surface.h"

namespace lodestone {

namespace {

constexpr const char* validation_layer = "VK_LAYER_KHRONOS_validation";

// All that there is; asked again where there are more by the time they are told. name: of the call.
template <class T, class Enumerate>
std::vector<T> enumerate(const char* name, Enumerate&& call) {
    for (;;) {
        uint32_t count = 0;
        vulkan_check(call(&count, nullptr), name);
        std::vector<T> items(count);
        const VkResult told = call(&count, items.data());
        if (told == VK_INCOMPLETE) continue;
        vulkan_check(told, name);
        items.resize(count);
        return items;
    }
}

bool has_extension(const std::vector<VkExtensionProperties>& extensions, const char* name) {
    return std::any_of(extensions.begin(), extensions.end(),
                       [&](const auto& e) { return std::strcmp(e.extensionName, name) == 0; });
}

DeviceInfo describe(VkPhysicalDevice physical) {
    VkPhysicalDeviceDriverProperties driver{};
    driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
    VkPhysicalDeviceProperties2 properties{};
    properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
    properties.pNext = &driver;
    vkGetPhysicalDeviceProperties2(physical, &properties);
    VkPhysicalDeviceMemoryProperties memory{};
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    DeviceInfo info;
    info.name = properties.properties.deviceName;
    info.driver = std::string(driver.driverName) + " " + driver.driverInfo;
    info.software = properties.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
    for (uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
        if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
            info.device_local_bytes += memory.memoryHeaps[i].size;
    }
    VkPhysicalDeviceFeatures features{};
    vkGetPhysicalDeviceFeatures(physical, &features);
    info.tessellates = features.tessellationShader != VK_FALSE;
    return info;
}

VkInstance bare_instance(const std::vector<const char*>& layers, const std::vector<const char*>& extensions,
                         const void* next) {
    VkApplicationInfo application{};
    application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    application.pApplicationName = "lodestone";
    application.apiVersion = VK_API_VERSION_1_3;
    VkInstanceCreateInfo create{};
    create.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    create.pNext = next;
    create.pApplicationInfo = &application;
    create.enabledLayerCount = static_cast<uint32_t>(layers.size());
    create.ppEnabledLayerNames = layers.data();
    create.enabledExtensionCount = static_cast<uint32_t>(extensions.size());
    create.ppEnabledExtensionNames = extensions.data();
    VkInstance instance = VK_NULL_HANDLE;
    LODE_VK(vkCreateInstance(&create, nullptr, &instance));
    return instance;
}

std::vector<VkPhysicalDevice> physical_devices(VkInstance instance) {
    return enumerate<VkPhysicalDevice>("vkEnumeratePhysicalDevices", [&](uint32_t* count, VkPhysicalDevice* devices) {
        return vkEnumeratePhysicalDevices(instance, count, devices);
    });
}

}  // namespace

std::vector<DeviceInfo> Device::list() {
    struct Destroy {
        void operator()(VkInstance instance) const { vkDestroyInstance(instance, nullptr); }
    };
    const LoadedLibraries before;
    const std::unique_ptr<std::remove_pointer_t<VkInstance>, Destroy> instance(bare_instance({}, {}, nullptr));
    before.keep_new();
    std::vector<DeviceInfo> all;
    for (VkPhysicalDevice physical : physical_devices(instance.get())) all.push_back(describe(physical));
    return all;
}

Device::Device(const std::string& wanted, bool validation, bool presents) {
    try {
        make_instance(validation, presents);
        choose(wanted);
        make_device(presents);
    } catch (...) {
        // The destructor does not run for a half-made object.
        if (messenger_ != VK_NULL_HANDLE) {
            reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
                vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"))(instance_, messenger_, nullptr);
        }
        if (instance_ != VK_NULL_HANDLE) vkDestroyInstance(instance_, nullptr);
        throw;
    }
}

Device::~Device() {
    vkDestroyDevice(device_, nullptr);
    if (messenger_ != VK_NULL_HANDLE) {
        reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"))(instance_, messenger_, nullptr);
    }
    vkDestroyInstance(instance_, nullptr);
}

VkBool32 Device::on_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                            const VkDebugUtilsMessengerCallbackDataEXT* data, void* self) {
    auto* device = static_cast<Device*>(self);
    const std::lock_guard lock(device->messages_mutex_);
    device->messages_.emplace_back(data->pMessage);
    return VK_FALSE;
}

void Device::make_instance(bool validation, bool presents) {
    const LoadedLibraries before;  // the loader may load drivers as soon as it is asked anything
    std::vector<const char*> layers, extensions;
    if (presents) extensions = surface_extensions();
    const auto known = enumerate<VkExtensionProperties>(
        "vkEnumerateInstanceExtensionProperties",
        [](uint32_t* n, VkExtensionProperties* e) { return vkEnumerateInstanceExtensionProperties(nullptr, n, e); });
    debug_utils_ = has_extension(known, VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    if (validation) {
        const auto present = enumerate<VkLayerProperties>(
            "vkEnumerateInstanceLayerProperties",
            [](uint32_t* n, VkLayerProperties* l) { return vkEnumerateInstanceLayerProperties(n, l); });
        const bool found = std::any_of(present.begin(), present.end(),
                                       [](const auto& l) { return std::strcmp(l.layerName, validation_layer) == 0; });
        if (!found)
            throw VulkanFailure("validation was asked for and " + std::string(validation_layer) +
                                " is not installed; install vulkan-validationlayers");
        layers.push_back(validation_layer);
        debug_utils_ = true;  // the layer brings it
    }
    if (debug_utils_) extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    VkDebugUtilsMessengerCreateInfoEXT messenger{};
    messenger.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
    messenger.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType =
        VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
    messenger.pfnUserCallback = on_message;
    messenger.pUserData = this;
    const VkValidationFeatureEnableEXT enabled[] = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    VkValidationFeaturesEXT features{};
    features.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
    features.pNext = &messenger;
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = enabled;
    instance_ = bare_instance(layers, extensions, validation ? &features : nullptr);
    before.keep_new();
    if (validation) {
        const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
        LODE_VK(create(instance_, &messenger, nullptr, &messenger_));
    }
}

void Device::choose(const std::string& wanted) {
    const auto devices = physical_devices(instance_);
    if (devices.empty())
        throw VulkanFailure(
            "no Vulkan device found; install a driver, or mesa-vulkan-drivers for the software rasteriser");
    std::vector<DeviceInfo> infos;
    for (VkPhysicalDevice d : devices) infos.push_back(describe(d));
    size_t chosen = devices.size();
    size_t number = 0;
    const char* end = wanted.data() + wanted.size();
    if (wanted.empty()) {
        chosen = static_cast<size_t>(
            std::find_if(infos.begin(), infos.end(), [](const DeviceInfo& i) { return !i.software; }) - infos.begin());
        if (chosen == devices.size()) chosen = 0;
    } else if (std::from_chars(wanted.data(), end, number).ptr == end) {
        chosen = number;
    } else {
        chosen = static_cast<size_t>(
            std::find_if(infos.begin(), infos.end(),
                         [&](const DeviceInfo& i) { return i.name.find(wanted) != std::string::npos; }) -
            infos.begin());
    }
    if (chosen >= devices.size()) {
        std::string names;
        for (size_t i = 0; i < infos.size(); ++i) names += (i ? ", " : "") + std::to_string(i) + ": " + infos[i].name;
        throw VulkanFailure("no device '" + wanted + "'; there are " + names);
    }
    physical_ = devices[chosen];
    info_ = infos[chosen];
}

// The features a device has, or is to be made with: a chain that must not be moved.
struct Device::Features {
    VkPhysicalDeviceVulkan13Features vulkan13{};
    VkPhysicalDeviceVulkan12Features vulkan12{};
    VkPhysicalDeviceFeatures2 all{};
    Features() {
        vulkan13.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES;
        vulkan12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
        vulkan12.pNext = &vulkan13;
        all.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
        all.pNext = &vulkan12;
    }
    Features(const Features&) = delete;
    Features& operator=(const Features&) = delete;
};

void Device::choose_queue_family() {
    const auto families =
        enumerate<VkQueueFamilyProperties>("queue families", [&](uint32_t* n, VkQueueFamilyProperties* q) {
            vkGetPhysicalDeviceQueueFamilyProperties(physical_, n, q);
            return VK_SUCCESS;
        });
    const auto draws_and_computes = [](const VkQueueFamilyProperties& f) {
        return (f.queueFlags & VK_QUEUE_GRAPHICS_BIT) != 0 && (f.queueFlags & VK_QUEUE_COMPUTE_BIT) != 0;
    };
    const auto family = std::find_if(families.begin(), families.end(), draws_and_computes);
    if (family == families.end()) throw VulkanFailure(info_.name + " has no queue that both draws and computes");
    queue_family_ = static_cast<uint32_t>(family - families.begin());
    timestamps_ = family->timestampValidBits >= 32 && limits_.timestampPeriod > 0;
}

void Device::check_features(const Features& have) const {
    const auto need = [&](VkBool32 present, const char* feature) {
        if (present == VK_FALSE)
            throw VulkanFailure(info_.name + " lacks the feature " + feature + "; choose another with --device");
    };
    need(have.vulkan13.dynamicRendering, "dynamicRendering");
    need(have.vulkan13.synchronization2, "synchronization2");
    need(have.vulkan13.maintenance4, "maintenance4");
    need(have.all.features.geometryShader, "geometryShader (for gl_PrimitiveID)");
    need(have.all.features.fullDrawIndexUint32, "fullDrawIndexUint32");
    VkFormatProperties depths{};
    vkGetPhysicalDeviceFormatProperties(physical_, VK_FORMAT_D32_SFLOAT_S8_UINT, &depths);
    constexpr VkFormatFeatureFlags drawn_and_read =
        VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT;
    need((depths.optimalTilingFeatures & drawn_and_read) == drawn_and_read ? VK_TRUE : VK_FALSE,
         "D32_SFLOAT_S8_UINT (depths beside a stencil)");
}

void Device::use_features(const Features& have, Features& use) const {
    const VkPhysicalDeviceFeatures& present = have.all.features;
    use.vulkan13.dynamicRendering = VK_TRUE;
    use.vulkan13.synchronization2 = VK_TRUE;
    use.vulkan13.maintenance4 = VK_TRUE;  // compute shaders say their local size by it
    use.vulkan12.drawIndirectCount = have.vulkan12.drawIndirectCount;
    // What an asset tells of indices and numbers is checked as it is opened, but not what playing it makes of them.
    use.all.features.robustBufferAccess = present.robustBufferAccess;
    use.all.features.geometryShader = VK_TRUE;
    use.all.features.fullDrawIndexUint32 = VK_TRUE;
    use.all.features.pipelineStatisticsQuery = present.pipelineStatisticsQuery;
    use.all.features.tessellationShader = present.tessellationShader;
    use.all.features.multiDrawIndirect = present.multiDrawIndirect;
    use.all.features.drawIndirectFirstInstance = present.drawIndirectFirstInstance;
    use.all.features.samplerAnisotropy = present.samplerAnisotropy;
    use.all.features.fillModeNonSolid = lines_ ? VK_TRUE : VK_FALSE;
}

void Device::make_device(bool presents) {
    VkPhysicalDeviceProperties properties{};
    vkGetPhysicalDeviceProperties(physical_, &properties);
    if (properties.apiVersion < VK_API_VERSION_1_3)
        throw VulkanFailure(info_.name + " has no Vulkan 1.3; update its driver or choose another with --device");
    limits_ = properties.limits;
    vkGetPhysicalDeviceMemoryProperties(physical_, &memory_);
    choose_queue_family();
    Features have, use;
    vkGetPhysicalDeviceFeatures2(physical_, &have.all);
    check_features(have);
    statistics_ = have.all.features.pipelineStatisticsQuery;
    draw_indirect_count_ = have.vulkan12.drawIndirectCount;
    lines_ = presents && have.all.features.fillModeNonSolid != VK_FALSE;
    use_features(have, use);
    const float priority = 1;
    VkDeviceQueueCreateInfo queue{};
    queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queue.queueFamilyIndex = queue_family_;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    VkDeviceCreateInfo create{};
    create.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    create.pNext = &use.all;
    create.queueCreateInfoCount = 1;
    create.pQueueCreateInfos = &queue;
    const char* swapchain = VK_KHR_SWAPCHAIN_EXTENSION_NAME;
    create.enabledExtensionCount = presents ? 1 : 0;
    create.ppEnabledExtensionNames = &swapchain;
    const LoadedLibraries before;
    LODE_VK(vkCreateDevice(physical_, &create, nullptr, &device_));
    before.keep_new();
    vkGetDeviceQueue(device_, queue_family_, 0, &queue_);
    load_debug_functions();
}

void Device::load_debug_functions() {
    if (!debug_utils_) return;
    set_name_ = reinterpret_cast<PFN_vkSetDebugUtilsObjectNameEXT>(
        vkGetInstanceProcAddr(instance_, "vkSetDebugUtilsObjectNameEXT"));
    begin_label_ = reinterpret_cast<PFN_vkCmdBeginDebugUtilsLabelEXT>(
        vkGetInstanceProcAddr(instance_, "vkCmdBeginDebugUtilsLabelEXT"));
    end_label_ = reinterpret_cast<PFN_vkCmdEndDebugUtilsLabelEXT>(
        vkGetInstanceProcAddr(instance_, "vkCmdEndDebugUtilsLabelEXT"));
}

std::vector<std::string> Device::messages() const {
    const std::lock_guard lock(messages_mutex_);
    return messages_;
}

void Device::name(VkObjectType type, uint64_t object, const std::string& name) const {
    if (set_name_ == nullptr) return;
    VkDebugUtilsObjectNameInfoEXT info{};
    info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT;
    info.objectType = type;
    info.objectHandle = object;
    info.pObjectName = name.c_str();
    LODE_VK(set_name_(device_, &info));
}

void Device::begin_label(VkCommandBuffer commands, const char* label) const {
    if (begin_label_ == nullptr) return;
    VkDebugUtilsLabelEXT info{};
    info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT;
    info.pLabelName = label;
    begin_label_(commands, &info);
}

void Device::end_label(VkCommandBuffer commands) const {
    if (end_label_ != nullptr) end_label_(commands);
}

}  // namespace lodestone
