//! Derive macros of `lobelia-graph`: [`macro@Ports`] and [`macro@Params`]. Use them through that crate.

use proc_macro::TokenStream;
use quote::{format_ident, quote};
use syn::{Attribute, Data, DeriveInput, Expr, ExprLit, ExprRange, Fields, Lit, Meta, RangeLimits, parse_macro_input, spanned::Spanned};

/// Text of the `///` comments, lines joined by spaces.
fn doc_of(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter(|attribute| attribute.path().is_ident("doc")).filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) => match &pair.value {
            Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value().trim().to_owned()),
            _ => None,
        },
        _ => None,
    });
    lines.collect::<Vec<_>>().join(" ").trim().to_owned()
}

fn named_fields(input: &DeriveInput) -> syn::Result<Vec<&syn::Field>> {
    match &input.data {
        Data::Struct(data) => match &data.fields {
            Fields::Named(fields) => Ok(fields.named.iter().collect()),
            other => Err(syn::Error::new(other.span(), "only structs with named fields are supported")),
        },
        _ => Err(syn::Error::new(input.span(), "only structs are supported")),
    }
}

/// Implements `lobelia_graph::Ports` for a struct whose fields are `R`, `Option<R>`, `Vec<R>` or `History<R>` with `R: Resource`, and defines beside it
/// `NAMEShapes` with the same fields holding shapes. Field documentation becomes the ports' documentation.
#[proc_macro_derive(Ports)]
pub fn derive_ports(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    ports(&input).unwrap_or_else(syn::Error::into_compile_error).into()
}

fn ports(input: &DeriveInput) -> syn::Result<proc_macro2::TokenStream> {
    let name = &input.ident;
    let visibility = &input.vis;
    let shapes = format_ident!("{name}Shapes");
    let shapes_doc = format!("Shapes of [`{name}`], field by field.");
    let fields = named_fields(input)?;
    let names: Vec<_> = fields.iter().filter_map(|field| field.ident.as_ref()).collect();
    let types: Vec<_> = fields.iter().map(|field| &field.ty).collect();
    let docs: Vec<_> = fields.iter().map(|field| doc_of(&field.attrs)).collect();
    let shape_docs: Vec<_> = names.iter().map(|name| format!("Shape of `{name}`.")).collect();
    let texts: Vec<_> = names.iter().map(ToString::to_string).collect();
    let indices: Vec<_> = (0..names.len()).collect();
    Ok(quote! {
        #[doc = #shapes_doc]
        #visibility struct #shapes {
            #(#[doc = #shape_docs] pub #names: <#types as ::lobelia_graph::PortField>::Shape,)*
        }

        impl ::lobelia_graph::Ports for #name {
            type Shapes = #shapes;
            fn infos() -> ::std::vec::Vec<::lobelia_graph::PortInfo> {
                ::std::vec![#(::lobelia_graph::PortInfo {
                    name: #texts,
                    doc: #docs,
                    resource: <#types as ::lobelia_graph::PortField>::resource(),
                    arity: <#types as ::lobelia_graph::PortField>::ARITY,
                    history: <#types as ::lobelia_graph::PortField>::HISTORY,
                }),*]
            }
            fn shapes(values: &[::lobelia_graph::PortValue]) -> ::std::option::Option<Self::Shapes> {
                ::std::option::Option::Some(#shapes {
                    #(#names: <#types as ::lobelia_graph::PortField>::shape(values.get(#indices)?)?,)*
                })
            }
            fn erase(shapes: &Self::Shapes) -> ::std::vec::Vec<::std::vec::Vec<::std::boxed::Box<dyn ::lobelia_graph::AnyShape>>> {
                ::std::vec![#(<#types as ::lobelia_graph::PortField>::erase(&shapes.#names)),*]
            }
            fn assemble(values: &[::lobelia_graph::PortValue]) -> ::std::option::Option<Self> {
                ::std::option::Option::Some(Self {
                    #(#names: <#types as ::lobelia_graph::PortField>::assemble(values.get(#indices)?)?,)*
                })
            }
        }
    })
}

/// Implements `lobelia_graph::Params`. Each field may carry `#[param(unit = "texels", range = 16..=4096)]`; both parts are optional, the ends of a range may be
/// left out, and an exclusive end is written `0.0..1.0`.
#[proc_macro_derive(Params, attributes(param))]
pub fn derive_params(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    params(&input).unwrap_or_else(syn::Error::into_compile_error).into()
}

#[derive(Default)]
struct ParamAttribute {
    unit: String,
    range: Option<ExprRange>,
}

fn param_attribute(attributes: &[Attribute]) -> syn::Result<ParamAttribute> {
    let mut found = ParamAttribute::default();
    for attribute in attributes.iter().filter(|attribute| attribute.path().is_ident("param")) {
        attribute.parse_nested_meta(|meta| {
            if meta.path.is_ident("unit") {
                found.unit = meta.value()?.parse::<syn::LitStr>()?.value();
                Ok(())
            } else if meta.path.is_ident("range") {
                found.range = Some(meta.value()?.parse()?);
                Ok(())
            } else {
                Err(meta.error("expected `unit` or `range`"))
            }
        })?;
    }
    Ok(found)
}

fn params(input: &DeriveInput) -> syn::Result<proc_macro2::TokenStream> {
    let name = &input.ident;
    let mut infos = Vec::new();
    let mut checks = Vec::new();
    for field in named_fields(input)? {
        let Some(ident) = &field.ident else { continue };
        let (text, doc, kind) = (ident.to_string(), doc_of(&field.attrs), &field.ty);
        let attribute = param_attribute(&field.attrs)?;
        let unit = &attribute.unit;
        let range = match &attribute.range {
            None => {
                checks.push(quote!(::lobelia_graph::params::check_finite(#text, &self.#ident)));
                String::new()
            }
            Some(range) => {
                let (start, end) = (&range.start, &range.end);
                let shown = |bound: &Option<Box<Expr>>| bound.as_ref().map(|bound| quote!(#bound).to_string().replace(' ', ""));
                let exclusive = matches!(range.limits, RangeLimits::HalfOpen(_)) && end.is_some();
                let close = if exclusive { ")" } else { "]" };
                let shown = match (shown(start), shown(end)) {
                    (Some(low), Some(high)) => format!("[{low}, {high}{close}"),
                    (Some(low), None) => format!("[{low}, infinity)"),
                    (None, Some(high)) => format!("(-infinity, {high}{close}"),
                    (None, None) => "the finite numbers".to_owned(),
                };
                let low = start.as_ref().map_or(quote!(f64::MIN), |low| quote!((#low) as f64));
                let high = match end {
                    None => quote!(f64::MAX),
                    Some(high) if exclusive => quote!(((#high) as f64).next_down()),
                    Some(high) => quote!((#high) as f64),
                };
                checks.push(quote!(::lobelia_graph::params::check_range(#text, &self.#ident, #low, #high, #shown)));
                shown
            }
        };
        infos.push(quote!(::lobelia_graph::ParamInfo {
            name: #text,
            doc: #doc,
            kind: <#kind as ::lobelia_graph::ParamValue>::kind(),
            unit: #unit,
            range: ::std::string::String::from(#range),
            default: ::lobelia_graph::params::ron_text(&default.#ident),
        }));
    }
    Ok(quote! {
        impl ::lobelia_graph::Params for #name {
            fn infos() -> ::std::vec::Vec<::lobelia_graph::ParamInfo> {
                let default = <Self as ::std::default::Default>::default();
                ::std::vec![#(#infos),*]
            }
            fn problems(&self) -> ::std::vec::Vec<::lobelia_graph::ParamProblem> {
                let checks: ::std::vec::Vec<::std::option::Option<::lobelia_graph::ParamProblem>> = ::std::vec![#(#checks),*];
                checks.into_iter().flatten().collect()
            }
        }
    })
}
