#pragma once

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace meshsmooth::testing {

/// A certificate and its key, in PEM.
struct KeyPair {
  std::string certificate;
  std::string key;
};

/// Signs certificates, made with OpenSSL while the test runs.
class CertificateAuthority {
 public:
  explicit CertificateAuthority(const std::string& name) : key_(make_key()) {
    certificate_ = make(name, key_.get(), nullptr, "CA:TRUE", "", 3600);
  }

  [[nodiscard]] std::string certificate() const { return pem(certificate_.get()); }

  /// For whoever is `name`; `alternative_names` as in "DNS:localhost,IP:127.0.0.1", or
  /// none. It ends in `seconds`, or has ended.
  [[nodiscard]] KeyPair issue(const std::string& name, const std::string& alternative_names,
                              long seconds = 3600) const {
    const Key key = make_key();
    const Certificate certificate =
        make(name, key.get(), this, "CA:FALSE", alternative_names, seconds);
    return {pem(certificate.get()), pem(key.get())};
  }

 private:
  using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
  using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;

  static Key make_key() { return {EVP_EC_gen("P-256"), &EVP_PKEY_free}; }

  static void extend(X509* certificate, int kind, const std::string& value) {
    X509V3_CTX context;
    X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
    X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
    if (extension == nullptr) throw std::runtime_error("OpenSSL does not take " + value);
    X509_add_ext(certificate, extension, -1);
    X509_EXTENSION_free(extension);
  }

  static Certificate make(const std::string& name, EVP_PKEY* key,
                          const CertificateAuthority* issuer, const std::string& constraints,
                          const std::string& alternative_names, long seconds) {
    static long serial = 1;
    Certificate certificate(X509_new(), &X509_free);
    X509* const x = certificate.get();
    X509_set_version(x, 2);
    ASN1_INTEGER_set(X509_get_serialNumber(x), serial++);
    X509_gmtime_adj(X509_getm_notBefore(x), -7200);
    X509_gmtime_adj(X509_getm_notAfter(x), seconds);
    X509_NAME_add_entry_by_txt(X509_get_subject_name(x), "CN", MBSTRING_UTF8,
                               reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1, 0);
    X509_set_issuer_name(x,
                         X509_get_subject_name(issuer != nullptr ? issuer->certificate_.get() : x));
    X509_set_pubkey(x, key);
    extend(x, NID_basic_constraints, "critical," + constraints);
    if (!alternative_names.empty()) extend(x, NID_subject_alt_name, alternative_names);
    X509_sign(x, issuer != nullptr ? issuer->key_.get() : key, EVP_sha256());
    return certificate;
  }

  static std::string text(BIO* bio) {
    char* data = nullptr;
    const long size = BIO_get_mem_data(bio, &data);
    std::string result(data, static_cast<std::size_t>(size));
    BIO_free(bio);
    return result;
  }
  static std::string pem(X509* certificate) {
    BIO* bio = BIO_new(BIO_s_mem());
    PEM_write_bio_X509(bio, certificate);
    return text(bio);
  }
  static std::string pem(EVP_PKEY* key) {
    BIO* bio = BIO_new(BIO_s_mem());
    PEM_write_bio_PrivateKey(bio, key, nullptr, nullptr, 0, nullptr, nullptr);
    return text(bio);
  }

  Key key_;
  Certificate certificate_{nullptr, &X509_free};
};

}  // namespace meshsmooth::testing
